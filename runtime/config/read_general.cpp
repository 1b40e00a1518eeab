#include <cmath>

#include <hil/numbers.hpp>

#include "runtime/config/section_readers.hpp"

namespace hil::config {
namespace {

std::optional<BaseRate> read_base_rate(const Value& value, Diagnostics& diagnostics) {
  constexpr double tolerance_ns =
      1e-2;  // of a second's worth of periods: what 12 digits of a rate can express
  const double hz = value.number();
  const double period_ns = std::round(1e9 / hz);
  if (std::abs(hz * period_ns - 1e9) <= tolerance_ns) {
    return BaseRate{1e9 / period_ns, static_cast<std::int64_t>(period_ns)};
  }
  diagnostics.add(value.place(), "'base_rate': a period of " + format_number(1e9 / hz) +
                                     " ns is no whole number of nanoseconds; the nearest rate with one is " +
                                     format_number(1e9 / period_ns) + " Hz");
  return std::nullopt;
}

void read_realtime(const Value& value, Realtime& realtime) {
  if (!is_whole(value)) return;
  realtime.scheduler = value["scheduler"].text() == "fifo" ? Scheduler::fifo : Scheduler::other;
  realtime.priority = static_cast<int>(value["priority"].integer());
  realtime.lock_memory = value["lock_memory"].boolean();
  for (const Value& cpu : value["cpus"].items())
    realtime.cpus.push_back(static_cast<int>(cpu.integer()));
  realtime.max_lost = value["max_lost"].number();
  if (value.has("max_hard_misses"))
    realtime.max_hard_misses = static_cast<std::uint64_t>(value["max_hard_misses"].integer());
  if (value.has("watchdog")) realtime.watchdog_ns = value["watchdog"].duration_ns();
}

}  // namespace

void read_general(const Value& root, Scenario& scenario, ReaderContext& reading) {
  if (root.has("scenario")) scenario.name = root["scenario"].text();
  if (root.has("about")) scenario.about = root["about"].text();
  if (root.has("base_rate")) reading.base = read_base_rate(root["base_rate"], reading.diagnostics);
  if (root.has("clock")) {
    scenario.clock = root["clock"].text() == "virtual" ? ClockKind::virtual_time : ClockKind::realtime;
    reading.clock = scenario.clock;
  }
  if (root.has("seed")) scenario.seed = static_cast<std::uint64_t>(root["seed"].integer());
  if (root.has("trace")) scenario.writes_trace = root["trace"].boolean();
  if (root.has("realtime")) read_realtime(root["realtime"], scenario.realtime);
  if (!reading.base) return;
  scenario.base_rate_hz = reading.base->hz;
  scenario.base_period_ns = reading.base->period_ns;
  if (!root.has("duration")) return;
  const std::optional<std::int64_t> ticks = multiple_of(root["duration"], scenario.base_period_ns, "duration",
                                                        "the base period", reading.diagnostics);
  scenario.duration_ns = root["duration"].duration_ns();
  reading.duration_ns = scenario.duration_ns;
  if (ticks) scenario.duration_ticks = static_cast<std::uint64_t>(*ticks);
}

}  // namespace hil::config
