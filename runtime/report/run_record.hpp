#pragma once
// The record of a run: all data of its report, as plain data that the session fills after the run. Each
// file of the report is a function of this record, so `hil report DIR` makes the same page again from
// report.json.
//
// Units: times in nanoseconds of run time (0 = first tick), durations in nanoseconds, lengths in metres,
// angles in radians, rates in hertz, bus load as a fraction of the bit rate. World frame: x east, y north,
// z up. An unknown double is NaN; files have null for it and the page shows a dash. Text may contain any
// bytes. Threads: plain data.

#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <hil/contribution.hpp>

#include "runtime/contract/plugin_identity.hpp"
#include "runtime/contribution/bus_record.hpp"
#include "runtime/report/signal_plot_record.hpp"

namespace hil::report {

/// Written into report.json. The reader refuses a file with another number. It grows with every key that is
/// added, removed or changes its meaning, since the reader needs all keys.
inline constexpr int schema_version = 17;

using contribution::BusGroup;
using contribution::BusRecord;
using contribution::Event;
using contribution::FieldOfView;
using contribution::Layer;
using contribution::layer_from;
using contribution::not_known;
using contribution::Picture;
using contribution::PointM;
using contribution::Section;
using contribution::SensorPoint;
using contribution::Shape;
using contribution::Track;
using contribution::TrackPoint;

enum class Verdict : std::uint8_t {
  passed,
  completed,      ///< nothing was checked: the scenario has no expectations
  failed,         ///< an expectation did not hold
  timing_broken,  ///< too many ticks or releases were lost, --fail-on held, or the base thread hung
  io_failed,
  gpu_failed,
  interrupted,  ///< the user stopped it before its duration was over
  refused,      ///< it did not begin: the scenario can not be set up
};

struct Scenario {
  std::string name;
  std::string file;
  std::string about;
};

struct Override {
  std::string path;
  std::string value;
};

struct Realtime {
  std::string scheduler;  ///< the one in effect: "SCHED_FIFO", "SCHED_OTHER"
  int priority = 0;
  bool locked_memory = false;
  std::vector<int> cpus;  ///< empty: no affinity
  std::string kernel;
  std::vector<std::string> degraded;  ///< sentences on what the machine did not permit
};

struct Gpu {
  std::string device;  ///< empty: the run had no database
  std::string driver;
  std::string api;
};

/// Quantiles of durations. With `samples` 0 the other members have no meaning.
struct Quantiles {
  std::uint64_t samples = 0;
  std::int64_t p50 = 0;
  std::int64_t p99 = 0;
  std::int64_t p999 = 0;
  std::int64_t max = 0;
};

/// Deadline minus end of a run; negative for a miss.
struct Slack {
  std::uint64_t samples = 0;
  std::int64_t min = 0;
  std::int64_t p50 = 0;
};

/// `count` values from `first_ns` to `last_ns`, both included.
struct Bin {
  std::int64_t first_ns = 0;
  std::int64_t last_ns = 0;
  std::uint64_t count = 0;
};

/// Ascending and disjoint bins of any width; empty ones may be missing.
using Histogram = std::vector<Bin>;

struct TaskHistograms {
  Histogram wake_latency_ns;
  Histogram wall_ns;
  Histogram cpu_ns;
  Histogram blocked_ns;
};

struct Miss {
  std::uint64_t tick = 0;
  std::string cause;  ///< "late wake-up", "own work", "database", ...
  std::int64_t lateness_ns = 0;
};

struct CauseCount {
  std::string cause;
  std::uint64_t count = 0;
};

struct Task {
  std::string name;
  double rate_hz = 0.0;
  std::string thread;  ///< empty: the base thread
  std::int64_t deadline_ns = 0;
  std::int64_t budget_ns = 0;  ///< CPU time per run; 0: none
  std::string overrun_policy;  ///< "skip", "queue", "abort"
  std::uint64_t runs = 0;      ///< without the warm-up
  std::uint64_t warmup_runs = 0;
  std::uint64_t deadline_misses = 0;
  std::uint64_t overruns = 0;  ///< releases while the task still ran
  std::uint64_t skipped = 0;
  std::uint64_t aborted = 0;
  std::uint64_t over_budget = 0;
  std::uint64_t without_result = 0;  ///< runs, warm-up runs included, in which a transaction failed
  std::uint64_t discarded = 0;       ///< of these: a firm transaction was late or not admitted
  std::uint64_t hard_misses = 0;     ///< runs, warm-up runs included, with a late hard transaction
  /// Misses, overruns, skipped, aborted and over_budget of the warm-up, which those counts do not include.
  std::uint64_t warmup_problems = 0;
  std::uint64_t page_faults = 0;
  Quantiles wake_latency_ns;
  Quantiles wall_ns;
  Quantiles cpu_ns;
  Quantiles blocked_ns;  ///< time waiting for the database
  Quantiles gpu_ns;
  Slack slack_ns;
  TaskHistograms histograms;
  /// Misses by cause; the sum is less than deadline_misses when records were lost.
  std::vector<CauseCount> misses_by_cause;
  std::int64_t worst_lateness_ns = 0;
  std::vector<Miss> misses;  ///< the first ones
  /// Of hard transactions, as `misses`.
  std::vector<Miss> first_hard_misses;
  Miss worst_hard_miss;
};

/// A part of the base tick. All stages, idle included, add up to the run.
struct BaseStage {
  std::string name;
  std::int64_t total_ns = 0;
  Quantiles per_tick_ns;
};

/// Quantiles of predicted over actual device time of transactions with queries of one kind.
struct CostPrediction {
  std::string cost_class;
  std::uint64_t count = 0;
  double p01 = 0.0;
  double median = 0.0;
  double p99 = 0.0;
};

/// Device time that the database keeps free for a module's hard transactions.
struct Reservation {
  std::string name;
  std::int64_t period_ns = 0;
  std::int64_t deadline_ns = 0;
  std::int64_t budget_ns = 0;
  std::uint64_t transactions = 0;
  std::uint64_t kept = 0;
  std::uint64_t broken = 0;
  std::uint64_t too_often = 0;
  std::uint64_t too_long = 0;
  std::int64_t largest_cost_ns = 0;
  std::int64_t longest_response_ns = 0;
};

/// The cost predictions and reservations of the database's scheduler.
struct Scheduler {
  std::uint64_t promised = 0;
  std::uint64_t kept = 0;
  std::uint64_t outranked = 0;
  std::uint64_t restarts = 0;
  std::vector<CostPrediction> predicted_over_actual;
  std::vector<Reservation> reservations;
  std::vector<std::string> not_reserved;  ///< the database's reason for each refused reservation
};

/// The database's log of the run (folder `database`).
struct DatabaseLog {
  std::string durability;  ///< "volatile", "async", "group", "sync"; volatile: there is no log
  std::uint64_t refused_transactions = 0;  ///< group, sync: writes that failed with the disk
  std::uint64_t latest_version = 0;
  std::uint64_t durable_version = 0;  ///< every version up to this one is on disk
  std::uint64_t bytes = 0;
  std::uint64_t groups = 0;  ///< writes, each with a sync
  std::uint64_t segments = 0;
  std::uint64_t checkpoints = 0;
  std::int64_t longest_write_ns = 0;
  std::int64_t all_writes_ns = 0;
  std::uint64_t ring_bytes = 0;  ///< capacity of the ring in which commits wait for the disk
  std::uint64_t ring_high_water_bytes = 0;
  std::uint64_t gaps = 0;  ///< how often the ring was full, so that commits were not recorded
  std::uint64_t commits_in_gaps = 0;
  std::uint64_t faults = 0;  ///< failed system calls
  std::string last_fault;
};

struct Transactions {
  std::uint64_t submitted = 0;
  std::uint64_t committed = 0;
  std::uint64_t late = 0;
  std::uint64_t missed = 0;
  std::uint64_t refused = 0;
  std::uint64_t conflicts = 0;
  std::uint64_t cancelled = 0;
  std::uint64_t truncated = 0;
  std::uint64_t device_lost = 0;
  std::uint64_t bad_input = 0;
  std::uint64_t firm_late_commits = 0;  ///< above 0: a fault of the database
  std::uint64_t hard_misses = 0;
};

struct Process {
  std::string name;
  std::string command;
  std::string exit;  ///< in words: "exit code 0", "signal 11 (SIGSEGV)", "running"
  std::optional<std::int64_t> ended_early_at_ns;  ///< set only when it ended before the run
  std::vector<std::string> last_lines{};          ///< of its output, when it ended before the run by itself
};

/// One time that a stimulus or a fault was active; the end of the run ends the last one.
struct ActiveSpan {
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
  bool operator==(const ActiveSpan&) const = default;
};

/// A hang of the base thread, or ticks that were skipped.
struct MissingTicks {
  std::int64_t time_ns = 0;  ///< run time of the first missing tick
  std::string text{};
  std::string fault{};  ///< of the scenario, which made a task take longer then; empty: none, and for a hang
};

/// A stimulus or a fault, and what became of it.
struct Injection {
  std::string name;
  std::string target;  ///< what it drives or acts on: a signal, a message, a device, a process, a task
  std::string effect;  ///< of a fault, in words: "stuck at its last value"
  std::uint64_t begins = 0;
  std::optional<std::int64_t> first_begin_ns{};
  std::int64_t active_ns = 0;       ///< in all
  std::vector<ActiveSpan> spans{};  ///< the first times that it was active
  /// Of a message or device: the frames or requests that came while it was active.
  std::optional<std::uint64_t> frames{};
  /// Of a stimulus: whether a reader took its value. Of a fault: whether a reader took a value that differs
  /// from the true one, or the fault changed a frame, a request or a step. Empty: not known, or never begun.
  std::optional<bool> took_effect{};
  /// Why it took none, or a part of it took none, or it never began: a clause.
  std::string missing_effect{};
  std::string test_table{};  ///< name of the test table that defines it; empty: the scenario defines it
};

enum class ExpectationResult : std::uint8_t {
  held,
  failed,
  not_checked,  ///< too little of the run could be evaluated
};

/// Ticks in succession on which an expectation was not evaluated.
struct NotEvaluated {
  std::int64_t begin_ns = 0, end_ns = 0;  ///< the first and the last of these ticks
  std::vector<std::string> signals;       ///< that were unknown
};

/// A figure of a signal with its limits, all in one unit.
struct LimitedFigure {
  std::string name;  ///< "mean"
  double value = 0.0;
  std::string unit;
  std::optional<double> min, max;
  bool is_held = true;
};

struct Expectation {
  std::string name;
  ExpectationResult result = ExpectationResult::not_checked;
  std::string detail;
  std::optional<std::int64_t> first_failure_ns{};
  std::uint64_t evaluated_ticks = 0;     ///< ticks on which it was true or false
  std::uint64_t covered_ticks = 0;       ///< ticks of the run on which it was due to be evaluated
  std::optional<std::int64_t> met_ns{};  ///< eventually: the instant at which it became true
  /// By how much it is held; negative: by how much it failed. NaN: not known.
  double margin = std::numeric_limits<double>::quiet_NaN();
  std::string margin_unit{};
  std::optional<std::int64_t> worst_ns{};     ///< the instant at which the margin was least
  std::vector<NotEvaluated> not_evaluated{};  ///< the first such intervals
  std::vector<LimitedFigure> figures{};       ///< statistics: those with a limit
  std::int64_t shift_ns = 0;                  ///< tracks: by which the signal is later than its reference
};

/// A bus or a process that was lost for longer than its time-out.
struct Loss {
  std::string what;  ///< "CAN bus car", "process dut"
  std::int64_t begin_ns = 0;
  std::int64_t duration_ns = 0;
  bool to_the_end = false;  ///< it was still lost when the run ended
  bool permitted = false;   ///< the scenario sets may_be_lost, or a fault of it is the cause
  std::string fault;        ///< the name of that fault; empty: none
  std::string cause;        ///< in words; may be empty
};

struct ResponseTime {
  std::string name;
  std::int64_t limit_ns = 0;  ///< 0: no limit
  std::vector<std::int64_t> samples_ns;
  std::uint64_t unanswered = 0;
  /// Unanswered requests that were not judged: the replying device was not connected, or the run ended
  /// before their time limit.
  std::uint64_t not_judged = 0;
};

/// The file recording.mcap.
struct Recording {
  std::string file;
  std::uint64_t bytes = 0;
  std::uint64_t messages = 0;                   ///< in the file
  std::uint64_t dropped = 0;                    ///< lost, since the disk was too slow
  std::optional<std::int64_t> stopped_at_ns{};  ///< set when its largest size was reached
  std::uint64_t not_recorded = 0;               ///< messages that did not fit after that
};

/// An image of the world at the end of the run, from a place that the scenario names (world.views).
struct View {
  std::string name;
  std::int64_t time_ns = 0;
  double exposure_value = 0.0;
  bool in_daylight = false;             ///< it sees no light of the world; a sun and a sky light it
  bool lights_overflow = false;         ///< the world has more lights than an image may have
  std::uint64_t incomplete_pixels = 0;  ///< lack light or show nothing
  std::string file{};                   ///< in the folder of the run; empty: it could not be written
  std::string image_png{};              ///< as contribution::ShownImage::png
};

struct ViewBox {
  PointM minimum;
  PointM maximum;
};

/// The world from above at one instant.
struct TopView {
  std::int64_t time_ns = 0;
  std::optional<ViewBox> view;  ///< the part to show; absent: all bodies and tracks with a margin
  std::vector<Shape> shapes;
  std::vector<Track> tracks;
  std::optional<FieldOfView> fan;
  std::vector<SensorPoint> scan_points;  ///< measured by a sensor in its last sweep
};

struct RunRecord {
  Scenario scenario;
  Verdict verdict = Verdict::passed;
  std::string reason;  ///< why, in one sentence
  int exit_code = 0;
  std::string program_version;
  std::vector<plugins::PluginIdentity> plugins;
  std::string clock;                ///< "realtime" or "virtual"
  std::uint64_t ticks = 0;          ///< executed
  std::uint64_t skipped_ticks = 0;  ///< not executed, since they were too late
  std::int64_t run_time_ns = 0;     ///< of executed and skipped ticks
  std::int64_t period_ns = 0;       ///< of the base rate
  std::int64_t duration_ns = 0;     ///< of the scenario; 0: until stopped
  std::string started_at;           ///< ISO 8601
  std::int64_t wall_ns = 0;         ///< wall-clock time of the run
  std::uint64_t seed = 0;
  std::vector<Override> overrides;
  Realtime realtime;
  Gpu gpu;
  std::vector<Task> tasks;
  std::vector<BaseStage> base_stages;
  std::vector<MissingTicks> watchdog;     ///< a hang, and the first times that ticks were skipped
  std::uint64_t watchdog_not_listed = 0;  ///< further times that ticks were skipped
  Transactions transactions;
  Scheduler scheduler;
  DatabaseLog database_log;
  std::vector<BusGroup> buses;  ///< one for each type of bus, also for those without a bus
  std::vector<Process> processes;
  std::vector<Injection> stimuli;
  std::vector<Injection> faults;
  std::vector<Expectation> expectations;
  std::vector<Loss> losses;
  std::uint64_t losses_not_listed = 0;
  /// The reasons for exit code 4, one sentence each, the most serious first: what was lost, not sent or not
  /// written.
  std::vector<std::string> failures;
  /// Reasons for exit code 1, one sentence each: messages and registers that did not come, rejected frames.
  std::vector<std::string> input_failures;
  std::vector<ResponseTime> response_times;
  std::vector<Event> events;
  std::uint64_t events_not_listed = 0;  ///< further ones of modules, stimuli and faults
  std::optional<TopView> top_view;
  std::vector<View> views;
  std::vector<Section> sections;                  ///< of modules
  std::vector<contribution::ModuleRecord> lists;  ///< records of modules, by the list that each names
  std::optional<Recording> recording;
  SignalPlots signal_plots;
};

/// The word in report.json: "not_checked".
const char* to_string(ExpectationResult result) noexcept;
/// The same for a reader: "not checked".
const char* words_of(ExpectationResult result) noexcept;
const char* to_string(Verdict verdict) noexcept;
const char* to_string(SeriesKind kind) noexcept;
std::optional<ExpectationResult> expectation_result_from(const std::string& word);
std::optional<Verdict> verdict_from(const std::string& word);
std::optional<SeriesKind> series_kind_from(const std::string& word);

}  // namespace hil::report
