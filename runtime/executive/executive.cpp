#include "runtime/executive/executive.hpp"

#include <algorithm>
#include <optional>
#include <utility>

#include "runtime/executive/base_loop.hpp"
#include "runtime/executive/machine.hpp"
#include "runtime/executive/misuse.hpp"
#include "runtime/executive/worker.hpp"

namespace hil::executive {

Executive::Executive(ExecutiveOptions options)
    : options_(std::move(options)), beat_(std::make_unique<BaseBeat>()) {
  require(options_.clock != nullptr, "an executive needs a clock");
  require(options_.base_period_ns >= 1, "the base period is at least 1 ns");
  require(!why_refused(options_.realtime).has_value(), "realtime options are checked with why_refused first");
  if (options_.hooks == nullptr) options_.hooks = &no_hooks_;
  if (options_.probe == nullptr) options_.probe = &system_probe_;
}

Executive::~Executive() = default;

void Executive::add_task(TaskSpec spec, Task& task) {
  require(!has_run_, "tasks are added before the run");
  require(!why_refused(spec, options_.base_period_ns).has_value(),
          "task specs are checked with why_refused first");
  for (const auto& slot : slots_)
    require(slot->spec.name != spec.name, "each task has a name of its own");
  const auto index = static_cast<std::uint32_t>(slots_.size());
  slots_.push_back(std::make_unique<TaskSlot>(std::move(spec), task, index, options_.base_period_ns));
}

Executive::Workers Executive::make_workers(std::vector<Worker*>& worker_of) const {
  Workers workers;
  worker_of.assign(slots_.size(), nullptr);
  if (options_.clock->is_virtual()) return workers;
  for (const auto& slot : slots_) {
    if (slot->on_base_thread()) continue;
    auto found = std::find_if(workers.begin(), workers.end(),
                              [&](const auto& worker) { return worker->name() == slot->spec.thread; });
    if (found == workers.end()) {
      workers.push_back(std::make_unique<Worker>(slot->spec.thread, *options_.clock, *options_.probe,
                                                 options_.accounting.records_per_thread));
      found = std::prev(workers.end());
    }
    (*found)->add(*slot);
    worker_of[slot->index] = found->get();
  }
  return workers;
}

/// Rate-monotonic below the base thread: the shorter the period, the higher the priority.
void Executive::start_workers(const Workers& workers, RealtimeOutcome& outcome) const {
  std::vector<std::int64_t> periods_ns;
  for (const auto& worker : workers)
    periods_ns.push_back(worker->shortest_period_ns());
  std::sort(periods_ns.begin(), periods_ns.end());
  periods_ns.erase(std::unique(periods_ns.begin(), periods_ns.end()), periods_ns.end());
  for (const auto& worker : workers) {
    const auto rank = std::lower_bound(periods_ns.begin(), periods_ns.end(), worker->shortest_period_ns());
    const int below = static_cast<int>(rank - periods_ns.begin()) + 1;
    for (std::string& refused :
         worker->start(options_.realtime, std::max(options_.realtime.priority - below, 1))) {
      add_once(outcome.degraded, std::move(refused));
    }
  }
}

namespace {

void note_machine(const RealtimeOptions& wanted, const ThreadRealtime& thread, const ProcessRealtime& process,
                  RealtimeOutcome& outcome) {
  outcome.scheduler = thread.fifo() ? Scheduler::fifo : Scheduler::other;
  outcome.priority = thread.fifo() ? wanted.priority : 0;
  outcome.memory_locked = process.memory_locked();
  if (thread.bound_to_cpus()) outcome.cpus = wanted.cpus;
  for (const std::string& refused : thread.refused())
    add_once(outcome.degraded, refused);
  for (const std::string& refused : process.refused())
    add_once(outcome.degraded, refused);
  for (std::string& limit : timing_limits(read_machine_state(), wanted.scheduler == Scheduler::fifo)) {
    add_once(outcome.degraded, std::move(limit));
  }
}

}  // namespace

RunResult Executive::run(const std::atomic<bool>& stop_requested) {
  require(!has_run_, "an executive runs once");
  has_run_ = true;
  RunResult result;
  result.virtual_clock = options_.clock->is_virtual();
  result.period_ns = options_.base_period_ns;
  result.reading_cost_ns = measure_reading_ns(*options_.probe);

  // The threads' rings must outlive the accounting, which reads them.
  std::vector<Worker*> worker_of;
  const Workers workers = make_workers(worker_of);
  Accounting accounting(options_.accounting, slots_, options_.base_period_ns, *options_.probe);
  for (const auto& worker : workers)
    accounting.add_ring(worker->records());
  BaseLoop loop(options_, *options_.probe, slots_, std::move(worker_of), accounting, *beat_);
  if (result.virtual_clock) {
    result.stopped = loop.run(stop_requested);
  } else {
    // Ordinary threads first, so that they do not inherit the base thread's scheduling.
    accounting.start();
    Watchdog watchdog(options_.watchdog, effective_timeout_ns(options_.watchdog, options_.base_period_ns),
                      beat_->ticks_begun);
    start_workers(workers, result.realtime);
    {
      const ProcessRealtime process(options_.realtime);
      const ThreadRealtime thread(options_.realtime, options_.realtime.priority);
      note_machine(options_.realtime, thread, process, result.realtime);
      result.stopped = loop.run(stop_requested);
      // Stop the watchdog before this thread becomes an ordinary one, since it may then wait long for a
      // processor without a hang.
      result.hang = watchdog.stop();
    }
    for (const auto& worker : workers)
      worker->stop();
  }
  loop.account_remaining();
  accounting.finish();

  result.ticks = beat_->ticks_begun.load(std::memory_order_relaxed);
  result.run_time_ns = static_cast<std::int64_t>(loop.next_tick()) * options_.base_period_ns;
  accounting.write_into(result, slots_, loop.start_ns());
  result.base.skipped_ticks = beat_->skipped_ticks.get();
  result.base.times_skipped = beat_->skips.get();
  return result;
}

LiveSnapshot Executive::live() const {
  LiveSnapshot snapshot;
  snapshot.ticks_begun = beat_->ticks_begun.load(std::memory_order_acquire);
  snapshot.run_time_ns = beat_->run_time_ns.get();
  snapshot.skipped_ticks = beat_->skipped_ticks.get();
  for (const auto& slot : slots_) {
    const TaskCounters& counted = slot->counters;
    snapshot.tasks.push_back({counted.runs.get(), counted.deadline_misses.get(), counted.overruns.get(),
                              counted.skipped.get(), counted.slack_min_ns.get()});
  }
  return snapshot;
}

}  // namespace hil::executive
