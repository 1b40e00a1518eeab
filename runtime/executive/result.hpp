#pragma once
// What a run leaves: everything report.json and the trace need. Times called run time start at 0 with the
// first tick.

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
  std::uint64_t tick = 0;  ///< the release
  MissCause cause = MissCause::own_work;
  std::int64_t lateness_ns = 0;
  DelayParts parts;  ///< where the time went
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
  std::uint64_t overruns = 0;         ///< runs that still ran when their next release arrived
  std::uint64_t skipped = 0;          ///< releases that were never run: overruns' and those of skipped ticks
  std::uint64_t aborted = 0;  ///< runs that were asked to stop, or not started any more, at their deadline
  std::uint64_t over_budget = 0;  ///< runs that used more CPU time than their budget
  std::uint64_t warmup_trouble =
      0;                          ///< of the five above, what fell into the warm-up and is not counted there
  std::int64_t minor_faults = 0;  ///< page faults, after the warm-up
  std::int64_t major_faults = 0;

  Histogram wake_latency;  ///< start - release
  Histogram wall;          ///< finish - start
  Histogram cpu;
  Histogram blocked;   ///< waiting for the database
  Histogram gpu;       ///< the GPU's share of that
  Histogram response;  ///< finish - release
  /// Slack is deadline - response: positive is good. 0 when there was no run.
  std::int64_t slack_min_ns = 0;
  std::int64_t slack_p50_ns = 0;

  std::vector<Miss>
      misses;  ///< the first ones, as many as AccountingOptions says; deadline_misses counts all
  /// Of all misses but those among RunResult::lost_records: how many by MissCause, and the largest lateness.
  std::array<std::uint64_t, miss_cause_count> misses_by_cause{};
  std::int64_t worst_lateness_ns = 0;
};

/// Ticks given up because real time had run ahead.
struct Skip {
  std::uint64_t tick = 0;                     ///< the first that was given up
  std::uint64_t count = 0;                    ///< how many
  MissCause cause = MissCause::earlier_task;  ///< late_wakeup, host_pause or earlier_task
};

struct BaseResult {
  Histogram wake;  ///< wake-up latency
  Histogram begin;
  Histogram publish;
  Histogram tasks;
  Histogram end;
  Histogram idle;
  std::uint64_t late_ticks =
      0;  ///< begun without sleeping, because the tick before took longer than its period
  std::uint64_t skipped_ticks = 0;
  std::uint64_t times_skipped = 0;
  std::vector<Skip> skips;  ///< the first ones, as many as AccountingOptions says; times_skipped counts all
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

/// One tick in the trace: the instant each stage ended, in run time. See TickRecord.
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
  std::uint64_t ticks_begun = 0;  ///< how many ticks had begun when the base thread fell silent
  std::int64_t silent_ns = 0;     ///< for how long when the watchdog called the safe state
};

struct RunResult {
  bool virtual_clock = false;
  bool stopped = false;  ///< ended by stop_requested, not by its duration
  std::int64_t period_ns = 0;
  std::uint64_t ticks = 0;       ///< that ran
  std::int64_t run_time_ns = 0;  ///< (ticks that ran + ticks skipped) * period
  RealtimeOutcome realtime;
  std::vector<TaskResult> tasks;  ///< in the order they were added
  BaseResult base;
  Trace trace;
  std::optional<Hang> hang;
  std::uint64_t lost_records =
      0;  ///< runs and ticks missing in histograms, misses and trace; the counters hold them
  std::int64_t look_ns = 0;  ///< what one look at CPU time and page faults costs; two looks per run on its
                             ///< own thread, one per run on the base thread
};

}  // namespace hil::executive
