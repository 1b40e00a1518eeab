#include "runtime/expectations/judges.hpp"

#include <algorithm>

namespace hil::expectations {

Judges::Judges(const config::Scenario& scenario, const signals::SignalTable& table, Arrivals& arrivals,
               ComputedSignals& variables)
    : arrivals_(arrivals), variables_(variables), readers_(table.size()), at_frame_(table.copy()) {
  for (const config::Expectation& expectation : scenario.expectations) {
    const auto number = static_cast<std::uint32_t>(judges_.size());
    const std::vector<signals::SignalId> read = signals_read(expectation, table);
    for (const signals::SignalId signal : variables_.with_sources(sampled_signals(expectation, table)))
      if (arrivals_.keeps(signal)) readers_[signal.index].judges.push_back(number);
    judges_.push_back(
        {.judge = make_judge({.expectation = expectation,
                              .table = table,
                              .arrivals = arrivals,
                              .max_samples = scenario.duration_ticks,
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
  arrived_ = arrivals_.collect();
  for (const Arrival& frame : arrived_)
    check_frame(frame, std::clamp(frame.time_ns, last_ns_, time_ns));
}

void Judges::check_frame(const Arrival& frame, std::int64_t time_ns) noexcept {
  ++frames_;
  last_ns_ = time_ns;
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
      Judged& judged = judges_[number];
      if (judged.last_frame == frames_) continue;
      judged.last_frame = frames_;
      judged.judge->check_frame(at_frame_, time_ns);
    }
  }
}

void Judges::check(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  for (Judged& judged : judges_) {
    judged.judge->check(table, arrived_, time_ns);
    if (judged.observers.empty() || !judged.judge->judged_in_last_check()) continue;
    for (signals::ReadObserver* const observer : judged.observers)
      observer->note_read(signals::ReadBy::expectation);
  }
  at_frame_.copy_values(table);
  last_ns_ = time_ns;
}

void Judges::fill(const Extent& extent, report::RunRecord& record) const {
  for (const Judged& judged : judges_) {
    record.expectations.push_back(judged.judge->result(extent));
    if (auto times = judged.judge->response_times(extent.end_ns))
      record.response_times.push_back(std::move(*times));
  }
}

}  // namespace hil::expectations
