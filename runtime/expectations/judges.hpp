#pragma once
// The judges of all expectations of a run.
//
// Threads: check from the base thread; fill after the run.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/expectations/kinds.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::expectations {

class Judges {
 public:
  /// `arrivals` outlives it, and keeps what the devices keep of every sample.
  Judges(const config::Scenario& scenario, const signals::SignalTable& table, const Arrivals& arrivals) {
    for (const config::Expectation& expectation : scenario.expectations) {
      const std::vector<signals::SignalId> read = signals_read(expectation, table);
      observers_.push_back(table.read_observers(read));
      judges_.push_back(
          make_judge({.expectation = expectation,
                      .table = table,
                      .arrivals = arrivals,
                      .max_samples = scenario.duration_ticks,
                      .options = {.period_ns = scenario.base_period_ns,
                                  .seed = scenario.seed + 0x9E3779B97F4A7C15u * (judges_.size() + 1)}}));
    }
  }

  /// After every tick, with the samples that arrived since the tick before.
  void check(const signals::SignalTable& table, std::span<const Arrival> arrived,
             std::int64_t time_ns) noexcept {
    for (std::size_t i = 0; i < judges_.size(); ++i) {
      judges_[i]->check(table, arrived, time_ns);
      if (observers_[i].empty() || !judges_[i]->judged_in_last_check()) continue;
      for (signals::ReadObserver* const observer : observers_[i])
        observer->note_read(signals::ReadBy::expectation);
    }
  }

  /// Adds the results and the response times.
  void fill(const Extent& extent, report::RunRecord& record) const {
    for (const auto& judge : judges_) {
      record.expectations.push_back(judge->result(extent));
      if (auto times = judge->response_times(extent.end_ns))
        record.response_times.push_back(std::move(*times));
    }
  }

 private:
  std::vector<std::unique_ptr<Judge>> judges_;
  std::vector<std::vector<signals::ReadObserver*>> observers_;  ///< by judge: of the signals that it reads
};

}  // namespace hil::expectations
