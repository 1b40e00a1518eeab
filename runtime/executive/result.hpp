#pragma once
// The result of a run: everything that report.json and the trace need. Run time is 0 at the first tick.

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/executive/histogram.hpp"
#include "runtime/executive/miss_cause.hpp"
#include "runtime/executive/realtime.hpp"

namespace hil::executive {

struct Miss {
  std::uint64_t tick = 0;  ///< the tick of the release
  MissCause cause = MissCause::own_work;
  std::int64_t lateness_ns = 0;
  DelayParts parts;  ///< the delays by cause
};

struct TaskResult {
  std::string name;
  std::string thread;  ///< empty: the base thread
  double rate_hz = 0.0;
  std::int64_t period_ns = 0;
  std::int64_t deadline_ns = 0;

  std::uint64_t runs = 0;  ///< after the warm-up
  std::uint64_t warmup_runs = 0;
  std::uint64_t deadline_misses = 0;  ///< runs that finished after their deadline
  std::uint64_t overruns = 0;         ///< runs that had not finished when their next release arrived
  std::uint64_t skipped = 0;          ///< releases without a run: because of overruns and of skipped ticks
  std::uint64_t aborted = 0;  ///< runs that were aborted, or cancelled before they started, at their deadline
  std::uint64_t over_budget = 0;  ///< runs that used more CPU time than their budget
  std::uint64_t warmup_problems =
      0;  ///< the part of the five counters above that belongs to the warm-up and is not included in them
  std::int64_t minor_faults = 0;  ///< page faults, after the warm-up
  std::int64_t major_faults = 0;

  Histogram wake_latency;  ///< start - release
  Histogram wall;          ///< finish - start
  Histogram cpu;
  Histogram blocked;   ///< waiting for the database
  Histogram gpu;       ///< the GPU's share of that
  Histogram response;  ///< finish - release
  /// Slack is deadline - response; positive means in time. 0 when there was no run.
  std::int64_t slack_min_ns = 0;
  std::int64_t slack_p50_ns = 0;

  std::vector<Miss>
      misses;  ///< the first ones, up to AccountingOptions::max_misses_per_task; deadline_misses counts all
  /// Of all misses except those in RunResult::lost_records: the number by MissCause, and the largest
  /// lateness.
  std::array<std::uint64_t, miss_cause_count> misses_by_cause{};
  std::int64_t worst_lateness_ns = 0;
};

/// Ticks that were skipped because they were too late.
struct Skip {
  std::uint64_t tick = 0;                     ///< the first skipped tick
  std::uint64_t count = 0;                    ///< how many
  MissCause cause = MissCause::earlier_task;  ///< late_wake_up, host_pause or earlier_task
};

struct BaseResult {
  Histogram wake;  ///< wake-up latency
  Histogram begin;
  Histogram publish;
  Histogram tasks;
  Histogram end;
  Histogram idle;
  std::uint64_t late_ticks =
      0;  ///< begun without sleeping, because the previous tick took longer than its period
  std::uint64_t skipped_ticks = 0;
  std::uint64_t times_skipped = 0;
  /// The first ones, up to the limit in AccountingOptions; times_skipped counts all
  std::vector<Skip> skips;
};

/// One run in the trace, in run time.
struct TaskSpan {
  std::uint32_t task = 0;  ///< index into RunResult::tasks
  bool missed = false;
  std::uint64_t tick = 0;
  std::int64_t start_ns = 0;
  std::int64_t finish_ns = 0;
  std::int64_t cpu_ns = 0;
  std::int64_t blocked_ns = 0;
};

/// One tick in the trace: the end of each stage in run time. See TickRecord.
struct TickSpan {
  std::uint64_t tick = 0;
  std::int64_t frame_begin_ns = 0;
  std::int64_t awake_ns = 0;
  std::int64_t begun_ns = 0;
  std::int64_t published_ns = 0;
  std::int64_t worked_ns = 0;
  std::int64_t ended_ns = 0;
  std::int64_t frame_end_ns = 0;
};

struct Trace {
  std::vector<TaskSpan> tasks;  ///< by start
  std::vector<TickSpan> ticks;  ///< by tick
};

struct Hang {
  /// Number of ticks that had begun when the base thread stopped making ticks
  std::uint64_t ticks_begun = 0;
  std::int64_t silent_ns = 0;  ///< time without a tick when the watchdog called safe_state
};

struct RunResult {
  bool virtual_clock = false;
  bool stopped = false;  ///< ended by stop_requested before its duration was over
  std::int64_t period_ns = 0;
  std::uint64_t ticks = 0;       ///< ticks that ran
  std::int64_t run_time_ns = 0;  ///< (ticks that ran + ticks skipped) * period
  RealtimeOutcome realtime;
  std::vector<TaskResult> tasks;  ///< in the order in which they were added
  BaseResult base;
  Trace trace;
  std::optional<Hang> hang;
  std::uint64_t lost_records =
      0;  ///< runs and ticks missing in histograms, misses and trace; the counters include them
  /// The cost of one reading of CPU time and page faults; there are two readings per run on another thread
  /// and one per run on the base thread.
  std::int64_t reading_cost_ns = 0;
};

}  // namespace hil::executive
