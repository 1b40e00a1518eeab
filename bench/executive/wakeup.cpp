#include "bench/executive/wakeup.hpp"

#include <array>
#include <atomic>

#include "bench/figure/figure.hpp"
#include "runtime/executive/executive.hpp"

namespace hil::bench {
namespace {

class EmptyTask final : public executive::Task {
 public:
  void step(const executive::TickInfo&) noexcept override {}
};

executive::RunResult run_executive(const ComparisonOptions& options, int task_count) {
  executive::MonotonicClock clock;
  executive::ExecutiveOptions wanted;
  wanted.clock = &clock;
  wanted.duration_ticks = options.ticks_per_round;
  wanted.realtime.scheduler = executive::Scheduler::fifo;
  wanted.realtime.priority = options.priority;
  wanted.realtime.lock_memory = true;
  std::array<EmptyTask, 10> tasks;
  executive::Executive executive(wanted);
  for (int task = 0; task < task_count; ++task) {
    executive::TaskSpec spec;
    spec.name = std::to_string(task);
    executive.add_task(spec, tasks.at(static_cast<std::size_t>(task)));
  }
  const std::atomic<bool> stop{false};
  return executive.run(stop);
}

struct Rounds {
  std::vector<double> p50_us, p99_us;
  std::uint64_t samples = 0;

  void add(const WakeupLatency& round) {
    p50_us.push_back(round.p50_us);
    p99_us.push_back(round.p99_us);
    samples += round.samples;
  }
  WakeupLatency medians() const { return {median(p50_us), median(p99_us), samples}; }
};

}  // namespace

WakeupComparison compare_wakeup(const ComparisonOptions& options) {
  WakeupComparison comparison;
  Rounds ours, theirs;
  const auto run_ours = [&] {
    const executive::RunResult result = run_executive(options, 0);
    const executive::Histogram& wake = result.base.wake;
    ours.add({static_cast<double>(wake.quantile_ns(0.5)) / 1e3,
              static_cast<double>(wake.quantile_ns(0.99)) / 1e3, wake.count()});
    comparison.fifo = result.realtime.scheduler == executive::Scheduler::fifo;
    comparison.degraded = result.realtime.degraded;
  };
  const auto run_theirs = [&] {
    theirs.add(run_cyclictest({options.ticks_per_round, 1'000, comparison.fifo ? options.priority : 0}));
  };
  for (int round = 0; round < options.rounds; ++round) {
    // The first round is the executive's, which determines the available scheduler.
    if (round % 2 == 0) {
      run_ours();
      run_theirs();
    } else {
      run_theirs();
      run_ours();
    }
  }
  comparison.ours = ours.medians();
  comparison.theirs = theirs.medians();
  return comparison;
}

TickOverhead measure_tick_overhead(const ComparisonOptions& options) {
  std::vector<double> medians_us;
  TickOverhead overhead;
  for (int round = 0; round < options.rounds; ++round) {
    std::vector<double> ticks_us;
    for (const executive::TickSpan& tick : run_executive(options, 10).trace.ticks) {
      ticks_us.push_back(static_cast<double>(tick.ended_ns - tick.awake_ns) / 1e3);
    }
    overhead.samples += ticks_us.size();
    medians_us.push_back(median(std::move(ticks_us)));
  }
  overhead.median_us = median(std::move(medians_us));
  return overhead;
}

}  // namespace hil::bench
