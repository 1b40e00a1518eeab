#include "runtime/run/run_buses.hpp"

#include <pthread.h>

#include <algorithm>
#include <cstring>
#include <utility>

#include "runtime/expectations/kinds.hpp"
#include "runtime/run/read_signals.hpp"

namespace hil::run {
namespace {

/// "CAN bus car"
std::string name_of(const config::BusSection& section) {
  return section.type->noun + " " + section.name.text;
}

}  // namespace

std::function<void()> RunBuses::thread_start(std::optional<int> priority, const std::string& name) {
  return [this, priority, name] {
    pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
    if (!priority) return;
    const sched_param parameters{.sched_priority = *priority};
    const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &parameters);
    if (error != 0) {
      context_.degraded.add("SCHED_FIFO was refused for the thread of " + name + " (" + std::strerror(error) +
                            ")");
    }
  };
}

void RunBuses::make_devices(recording::Recorder* recorder) {
  for (const WiredBus& wired : wiring_.buses) {
    const config::BusSection& section = *wired.section;
    const std::string thread_name = section.type->key + " " + section.name.text;
    std::function<void()> on_thread_start = thread_start(section.thread_priority, thread_name);
    RunningBus& bus = buses_.emplace_back(RunningBus{
        .wired = &wired,
        .device = wired.bus->make_device(
            {.scenario = context_.scenario,
             .directory = context_.options.directory,
             .on_thread_start = std::move(on_thread_start),
             .stop_requested = context_.stop_requested,
             .frames = recorder == nullptr ? nullptr : recorder->frame_sink(section.full_name())})});
    keep_judged_arrivals(bus);
    for (const BusFault& fault : wiring_.bus_faults) {
      if (fault.bus + 1 == buses_.size()) bus.device->add_fault(fault.injected);
    }
    if (bus.device->start_phase() == buses::StartPhase::before_programs) start(bus);
  }
}

void RunBuses::keep_judged_arrivals(RunningBus& bus) {
  for (const config::Expectation& expectation : context_.scenario.expectations) {
    auto judged = expectations::signals_judged_by_arrival(expectation, wiring_.signals);
    for (const signals::SignalId signal : wiring_.variables.with_sources(std::move(judged)))
      arrivals_.keep(bus.device->device(), bus.wired->links, signal);
  }
}

void RunBuses::start(RunningBus& bus) {
  bus.device->device().start(context_.device_clock, context_.pacing());
  const config::BusSection& section = *bus.wired->section;
  if (!section.type->has_address) return;
  context_.log.info(name_of(section) + ": " + bus.device->address());
}

bool RunBuses::all_programs_connected(const ProcessWatch& processes, std::int64_t waited_ns) const {
  const buses::StartedPrograms programs{
      .process_of = [&](const std::string& name) { return processes.process_of(name); },
      .waited_ns = waited_ns};
  bool complete = true;
  for (const RunningBus& bus : buses_) {
    const bool connected = bus.device->all_programs_connected(programs);
    complete = connected && complete;
  }
  return complete;
}

void RunBuses::start_remaining_devices() {
  for (RunningBus& bus : buses_) {
    if (bus.device->start_phase() == buses::StartPhase::after_programs) start(bus);
  }
  std::vector<LossWatch::Subject> subjects;
  std::vector<DeviceWatch::Subject> watched;
  for (const RunningBus& bus : buses_) {
    const config::BusSection& section = *bus.wired->section;
    io::Device& device = bus.device->device();
    links_.push_back(
        std::make_unique<DeviceLink>(device, bus.wired->links, wiring_.signals, context_.pacing()));
    subjects.push_back({&device, name_of(section), section.may_be_lost});
    watched.push_back({&device, name_of(section)});
  }
  device_watch_.emplace(std::move(watched), context_.is_virtual ? DeviceWatch::Causes::only_reported
                                                                : DeviceWatch::Causes::in_events);
  loss_watch_.emplace(std::move(subjects));
  watch_inputs();
}

void RunBuses::watch_inputs() {
  std::vector<InputWatch::InputRule> rules;
  for (std::size_t bus = 0; bus < buses_.size(); ++bus) {
    const config::BusSection& section = *buses_[bus].wired->section;
    const io::Device& device = buses_[bus].device->device();
    buses_[bus].first_input = inputs_.size();
    for (std::size_t group = 0; group < device.input_groups().size(); ++group) {
      const io::InputGroup& inputs = device.input_groups()[group];
      const buses::InputRule rule = buses_[bus].wired->bus->input_rule(group);
      rules.push_back({.name = section.type->input_noun + " " + section.full_name() + "." + inputs.name,
                       .has_to_come = rule.has_to_come,
                       .recovery_ns = inputs.timeout_ns > 0 ? inputs.timeout_ns : device.loss_timeout_ns(),
                       .max_rejected = rule.max_rejected});
      inputs_.push_back({bus, group});
    }
  }
  watch_read_signals(rules);
  input_states_.resize(inputs_.size());
  input_watch_.emplace(std::move(rules), context_.scenario.base_period_ns);
}

void RunBuses::watch_read_signals(std::vector<InputWatch::InputRule>& rules) {
  const std::vector<signals::SignalId> read = signals_read_in(wiring_);
  const std::size_t groups = inputs_.size();
  for (std::size_t i = 0; i < groups; ++i) {
    const std::size_t bus = inputs_[i].bus, number = inputs_[i].group;
    const io::InputGroup& group = buses_[bus].device->device().input_groups()[number];
    if (group.count == 1) continue;
    for (std::size_t input = group.first; input < group.first + group.count; ++input) {
      const signals::SignalId signal = buses_[bus].wired->links.inputs[input];
      if (std::ranges::find(read, signal) == read.end()) continue;
      rules.push_back({.name = "signal " + wiring_.signals.info(signal).name,
                       .has_to_come = rules[i].has_to_come,
                       .recovery_ns = rules[i].recovery_ns,
                       .group = i});
      inputs_.push_back({.bus = bus, .group = number, .input = input});
    }
  }
}

std::string RunBuses::address_of(const std::string& section, const std::string& name) const {
  if (section == "clock") return context_.is_virtual ? "stepped" : "wall";
  for (const RunningBus& bus : buses_) {
    const config::BusSection& of_bus = *bus.wired->section;
    if (of_bus.type->key == section && of_bus.name.text == name) return bus.device->address();
  }
  return {};
}

void RunBuses::add_tasks(executive::Executive& executive) {
  for (std::size_t i = 0; i < buses_.size(); ++i) {
    const config::BusSection& section = *buses_[i].wired->section;
    executive.add_task({.name = section.full_name(), .every_ticks = section.every_ticks, .thread = {}},
                       *links_[i]);
  }
}

void RunBuses::set_fault(const BusFault& fault, const std::string& name, bool active) noexcept {
  io::FaultTarget& target = fault_target(fault.bus);
  target.set_fault(fault.number, active);
  if (!fault.injected.message.empty()) return;
  loss_watch_->set_fault(fault.bus, name, active);
  if (target.silences(fault.number)) set_inputs_silenced(fault.bus, active);
}

io::FaultTarget& RunBuses::fault_target(std::size_t bus) const noexcept {
  return *links_[bus]->device().fault_target();
}

void RunBuses::set_away(std::size_t bus, pid_t process, const std::string& name, bool away) noexcept {
  if (io::FaultTarget* const target = links_[bus]->device().fault_target()) {
    if (context_.is_virtual) target->set_away(process, away);
    target->note_interruption();
  }
  loss_watch_->set_fault(bus, name, away);
  set_inputs_silenced(bus, away);
}

void RunBuses::set_inputs_silenced(std::size_t bus, bool active) noexcept {
  for (std::size_t input = 0; input < inputs_.size(); ++input)
    if (inputs_[input].bus == bus) input_watch_->set_fault(input, active);
}

void RunBuses::end_tick(std::int64_t time_ns) noexcept {
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const auto [bus, group, input, faulted_before, newest_before_ns] = inputs_[i];
    io::Device& device = links_[bus]->device();
    const bool is_connected = device.connected() && device.has_answered();
    const bool is_lost = buses_[bus].lacks_program->load(std::memory_order_relaxed) ||
                         (buses_[bus].wired->section->may_be_lost && !is_connected);
    if (const io::FaultTarget* const target = device.fault_target())
      inputs_[i].faulted = input ? target->faulted_values(*input) : target->faulted_frames(group);
    const io::InputGroup& all = device.input_groups()[group];
    inputs_[i].newest_ns = links_[bus]->newest_ns(input.value_or(all.first), input ? 1 : all.count);
    const bool is_fresh = input ? links_[bus]->is_fresh_input(*input) : links_[bus]->is_fresh(group);
    input_states_[i] = {.is_fresh = is_fresh,
                        .has_come = is_fresh && inputs_[i].newest_ns > newest_before_ns,
                        .is_faulted = inputs_[i].faulted != faulted_before,
                        .is_permitted_loss = is_lost};
  }
  input_watch_->check(time_ns, input_states_);
}

void RunBuses::begin_tick(std::int64_t time_ns) noexcept {
  for (const auto& link : links_)
    link->latch_inputs(time_ns);
  loss_watch_->check(time_ns);
  for (const auto& link : links_)
    link->hold_safe_values(loss_watch_->outputs_must_be_safe());
  if (context_.is_virtual) check_devices(time_ns);
}

bool RunBuses::ends_run(std::size_t bus) const noexcept {
  const bool is_permitted_loss =
      buses_[bus].wired->section->may_be_lost && !links_[bus]->device().connected();
  return !links_[bus]->in_step() && !is_permitted_loss;
}

bool RunBuses::in_step() const noexcept {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (ends_run(i)) return false;
  }
  return true;
}

std::string RunBuses::step_fault() const {
  for (std::size_t i = 0; i < links_.size(); ++i) {
    if (!ends_run(i)) continue;
    const std::string fault = links_[i]->device().fault();
    return name_of(*buses_[i].wired->section) +
           " did not complete the exchange of this tick: " + (fault.empty() ? "no reply" : fault);
  }
  return {};
}

void RunBuses::write_to_log(bool is_expected, const std::string& sentence) {
  is_expected ? context_.log.info(sentence) : context_.log.warn(sentence);
}

void RunBuses::check() {
  if (!context_.is_virtual) check_devices(context_.device_clock.report_ns());
}

void RunBuses::check_devices(std::int64_t time_ns) {
  device_watch_->check(time_ns, [this](bool is_expected, const std::string& sentence) {
    write_to_log(is_expected, sentence);
  });
}

std::vector<report::LiveBus> RunBuses::bus_loads() const {
  std::vector<report::LiveBus> loads;
  for (const RunningBus& bus : buses_) {
    if (const std::optional<double> load = bus.device->load())
      loads.push_back({bus.wired->section->name.text, *load});
  }
  return loads;
}

void RunBuses::enter_safe_state() noexcept {
  for (const auto& link : links_)
    link->device().enter_safe_state();
}

void RunBuses::stop() noexcept {
  enter_safe_state();
  for (const auto& link : links_)
    link->device().stop();
}

void RunBuses::collect_last_events() {
  device_watch_->collect_last_events(
      [this](bool is_expected, const std::string& sentence) { write_to_log(is_expected, sentence); });
}

void RunBuses::fill(std::int64_t end_ns, report::RunRecord& record) const {
  for (const RunningBus& bus : buses_) {
    const auto group =
        std::ranges::find(record.buses, bus.wired->section->type->key, &report::BusGroup::list_key);
    group->buses.push_back(bus.device->record());
    group->buses.back().fields.push_back({"inputs", input_rows(bus)});
    const std::optional<buses::PlaybackRecord> playback = bus.device->playback();
    if (!playback) continue;
    report::Injection log{.name = bus.wired->section->full_name(),
                          .target = bus.wired->section->full_name(),
                          .effect = "plays " + playback->file,
                          .begins = playback->passes,
                          .first_begin_ns = playback->first_begin_ns,
                          .frames = playback->frames};
    if (log.first_begin_ns) {
      log.took_effect = playback->frames > 0;
      log.spans = {{*log.first_begin_ns, playback->end_ns.value_or(end_ns)}};
      log.active_ns = log.spans[0].end_ns - log.spans[0].begin_ns;
    }
    record.stimuli.push_back(std::move(log));
  }
}

std::vector<contribution::BusRow> RunBuses::input_rows(const RunningBus& bus) const {
  std::vector<contribution::BusRow> rows;
  const io::Device& device = bus.device->device();
  for (std::size_t group = 0; group < device.input_groups().size(); ++group) {
    const InputWatch::Figures figures = input_watch_->figures(bus.first_input + group);
    const io::RejectedFrames rejected = device.rejected(group);
    rows.push_back({{"input", device.input_groups()[group].name},
                    {"ticks", figures.ticks},
                    {"not_fresh", figures.not_fresh},
                    {"rejected", rejected.count},
                    {"rejected_by_scenario", rejected.by_scenario}});
  }
  return rows;
}

std::vector<std::string> RunBuses::input_failures() const {
  std::vector<std::string> all;
  for (std::size_t i = 0; i < inputs_.size(); ++i) {
    const WatchedInput& input = inputs_[i];
    const io::RejectedFrames rejected =
        input.input ? io::RejectedFrames{} : buses_[input.bus].device->device().rejected(input.group);
    for (std::string& sentence : input_watch_->failures(i, rejected))
      all.push_back(std::move(sentence));
  }
  return all;
}

std::vector<std::string> RunBuses::send_faults() const {
  std::vector<std::string> faults;
  for (const auto& link : links_) {
    if (std::string fault = link->device().send_fault(); !fault.empty()) faults.push_back(std::move(fault));
  }
  return faults;
}

std::vector<std::string> RunBuses::log_files() const {
  std::vector<std::string> files;
  for (const RunningBus& bus : buses_) {
    if (std::string file = bus.device->log_file(); !file.empty()) files.push_back(std::move(file));
  }
  return files;
}

std::vector<std::string> RunBuses::log_faults() const {
  std::vector<std::string> faults;
  for (const RunningBus& bus : buses_) {
    if (std::string fault = bus.device->log_fault(); !fault.empty()) faults.push_back(std::move(fault));
  }
  return faults;
}

}  // namespace hil::run
