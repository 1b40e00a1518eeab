#include "runtime/run/run_recording.hpp"

#include <system_error>
#include <utility>

#include "runtime/report/report_text.hpp"

namespace hil::run {
namespace {

constexpr const char* recording_file = "recording.mcap";

}  // namespace

std::unique_ptr<recording::Recorder> make_recorder(const Wiring& wiring, const RunContext& context) {
  const config::Scenario& scenario = *wiring.scenario;
  if (!scenario.recording) return nullptr;
  recording::RecorderOptions options{.file = context.options.directory / recording_file,
                                     .max_bytes = scenario.recording->max_bytes,
                                     .virtual_clock = context.is_virtual,
                                     .frame_buses = {},
                                     .about_run = {{"scenario", scenario.name},
                                                   {"seed", std::to_string(scenario.seed)},
                                                   {"clock", context.is_virtual ? "virtual" : "realtime"},
                                                   {"program_version", HIL_VERSION}}};
  for (const WiredBus& wired : wiring.buses) {
    const auto& format = buses::type_of(*wired.section).frames;
    if (scenario.recording->frames && format)
      options.frame_buses.push_back({wired.section->full_name(), *format});
  }
  return std::make_unique<recording::Recorder>(std::move(options), wiring.signals, wiring.recorded);
}

std::vector<std::string> close_recording(recording::Recorder& recorder,
                                         const std::filesystem::path& directory, report::RunRecord& record) {
  std::vector<recording::RecordedEvent> events;
  for (const report::Event& event : record.events)
    events.push_back({event.time_ns, event.text});
  std::vector<recording::RecordedMiss> misses;
  for (const report::Task& task : record.tasks) {
    for (const report::Miss& miss : task.misses)
      misses.push_back({.time_ns = static_cast<std::int64_t>(miss.tick) * record.period_ns,
                        .task = task.name,
                        .tick = miss.tick,
                        .cause = miss.cause,
                        .lateness_ns = miss.lateness_ns});
  }
  const recording::RecordingResult result = recorder.close(events, misses);
  record.recording = report::Recording{.file = recording_file,
                                       .bytes = result.bytes,
                                       .messages = result.messages,
                                       .dropped = result.dropped,
                                       .stopped_at_ns = result.stopped_at_ns,
                                       .not_recorded = result.not_recorded};
  for (std::string& sentence : report::lacks_of(*record.recording))
    record.realtime.degraded.push_back(std::move(sentence));
  std::vector<std::string> faults;
  if (!result.fault.empty()) faults.push_back(result.fault);
  const std::filesystem::path path = directory / recording_file;
  std::error_code error;
  if (!std::filesystem::exists(path, error))
    faults.push_back(path.string() + " was removed while the run went on");
  return faults;
}

}  // namespace hil::run
