#include "runtime/expectations/judges.hpp"

#include <algorithm>

namespace hil::expectations {

Judges::Judges(const config::Scenario& scenario, const signals::SignalTable& table, Arrivals& arrivals,
               ComputedSignals& variables)
    : arrivals_(arrivals), variables_(variables), readers_(table.size()), at_frame_(table.copy()) {
  for (const config::Expectation& expectation : scenario.expectations) {
    const auto number = static_cast<std::uint32_t>(judges_.size());
    const std::vector<signals::SignalId> read = signals_read(expectation, table);
    bool judges_frames = false;
    for (const signals::SignalId signal :
         variables_.with_sources(signals_judged_by_arrival(expectation, table))) {
      if (!arrivals_.keeps(signal)) continue;
      readers_[signal.index].judges.push_back(number);
      judges_frames = true;
    }
    judges_.push_back(
        {.judge = make_judge({.expectation = expectation,
                              .table = table,
                              .arrivals = arrivals,
                              .duration_ticks = scenario.duration_ticks,
                              .judges_frames = judges_frames,
                              .options = {.period_ns = scenario.base_period_ns,
                                          .seed = scenario.seed + 0x9E3779B97F4A7C15u * (number + 1)}}),
         .observers = table.read_observers(read)});
  }
  std::size_t variable_count = 0;
  for (std::uint32_t index = 0; index < readers_.size(); ++index) {
    if (readers_[index].judges.empty()) continue;
    readers_[index].variables = variables_.numbers_reading(std::vector{signals::SignalId{index}});
    if (!readers_[index].variables.empty())
      variable_count = std::max<std::size_t>(variable_count, readers_[index].variables.back() + 1);
  }
  due_variables_.reserve(variable_count);
}

void Judges::check_frames(std::int64_t time_ns) noexcept {
  for (const Arrival& frame : arrivals_.collect())
    check_frame(frame, std::clamp(frame.time_ns, last_ns_, time_ns));
}

void Judges::check_last_frames(std::int64_t end_ns) noexcept {
  for (std::span<const Arrival> frames = arrivals_.collect(); !frames.empty(); frames = arrivals_.collect())
    for (const Arrival& frame : frames)
      if (frame.time_ns < end_ns) check_frame(frame, std::max(frame.time_ns, last_ns_));
}

void Judges::check_frame(const Arrival& frame, std::int64_t time_ns) noexcept {
  ++frame_number_;
  last_ns_ = time_ns;
  arrivals_.set_current(frame);
  for (const ArrivedValue& arrived : frame.values)
    at_frame_.write(arrived.signal, {.value = arrived.value, .time_ns = frame.time_ns, .fresh = true});
  due_variables_.clear();
  for (const ArrivedValue& arrived : frame.values)
    for (const std::uint32_t number : readers_[arrived.signal.index].variables)
      if (const auto place = std::ranges::lower_bound(due_variables_, number);
          place == due_variables_.end() || *place != number)
        due_variables_.insert(place, number);
  variables_.update_at_frame(at_frame_, time_ns, due_variables_);
  for (const ArrivedValue& arrived : frame.values) {
    for (const std::uint32_t number : readers_[arrived.signal.index].judges) {
      JudgeEntry& entry = judges_[number];
      if (entry.last_frame == frame_number_) continue;
      entry.last_frame = frame_number_;
      entry.judge->check(at_frame_, {.time_ns = time_ns, .is_tick = false});
    }
  }
}

void Judges::check(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  for (JudgeEntry& entry : judges_) {
    entry.judge->check(table, {.time_ns = time_ns});
    if (entry.observers.empty() || !entry.judge->judged_in_last_check()) continue;
    for (signals::ReadObserver* const observer : entry.observers)
      observer->note_read(signals::ReadBy::expectation);
  }
  at_frame_.copy_values(table);
  last_ns_ = time_ns;
}

void Judges::fill(const Extent& extent, report::RunRecord& record) const {
  for (const JudgeEntry& entry : judges_) {
    record.expectations.push_back(entry.judge->result(extent));
    if (auto times = entry.judge->response_times(extent.end_ns))
      record.response_times.push_back(std::move(*times));
  }
}

}  // namespace hil::expectations
