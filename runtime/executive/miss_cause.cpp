#include "runtime/executive/miss_cause.hpp"

#include <algorithm>

namespace hil::executive {
namespace {

/// Moves at most `wanted_ns` from one part to another.
void move_time(std::int64_t& from_ns, std::int64_t& to_ns, std::int64_t wanted_ns) noexcept {
  const std::int64_t moved_ns = std::clamp<std::int64_t>(wanted_ns, 0, from_ns);
  from_ns -= moved_ns;
  to_ns += moved_ns;
}

std::int64_t span_ns(std::int64_t begin_ns, std::int64_t end_ns) noexcept {
  return std::max<std::int64_t>(end_ns - begin_ns, 0);
}

void attribute_wait(const RunEvidence& run, DelayParts& parts) noexcept {
  const std::int64_t base_wake_ns = std::clamp(run.base_wake_ns, run.release_ns, run.ready_ns);
  const std::int64_t thread_free_ns = std::clamp(run.thread_free_ns, run.ready_ns, run.start_ns);
  parts[MissCause::late_wake_up] =
      span_ns(run.release_ns, base_wake_ns) + span_ns(thread_free_ns, run.start_ns);
  parts[MissCause::earlier_task] =
      span_ns(base_wake_ns, run.ready_ns) + span_ns(run.ready_ns, thread_free_ns);

  const std::int64_t behind_itself_ns =
      span_ns(run.release_ns, std::min(run.same_task_until_ns, run.start_ns));
  if (behind_itself_ns > 0) {
    std::int64_t inherited_ns = 0;
    move_time(parts[MissCause::earlier_task], inherited_ns, behind_itself_ns);
    parts[run.same_task_cause] += inherited_ns;
  }
  std::int64_t paused_ns = run.pause_before_start_ns;
  for (const MissCause delayed : {MissCause::late_wake_up, MissCause::earlier_task}) {
    const std::int64_t moved_ns = std::min(paused_ns, parts[delayed]);
    move_time(parts[delayed], parts[MissCause::host_pause], moved_ns);
    paused_ns -= moved_ns;
  }
}

void attribute_step(const RunEvidence& run, DelayParts& parts) noexcept {
  const std::int64_t wall_ns = span_ns(run.start_ns, run.finish_ns);
  const std::int64_t blocked_ns = std::clamp<std::int64_t>(run.blocked_ns, 0, wall_ns);
  // A spinning wait uses CPU time but still counts as the database's.
  std::int64_t cpu_ns = std::clamp<std::int64_t>(run.cpu_ns, 0, wall_ns - blocked_ns);
  std::int64_t off_cpu_ns = wall_ns - blocked_ns - cpu_ns;

  std::int64_t database_ns = blocked_ns;
  move_time(cpu_ns, parts[MissCause::page_fault], run.minor_faults * minor_fault_ns);
  std::int64_t paused_ns = 0;
  move_time(off_cpu_ns, paused_ns, run.pause_in_step_ns);
  // While the process was stopped, the database could not run either.
  move_time(database_ns, paused_ns, run.process_pause_in_step_ns - paused_ns);
  parts[MissCause::host_pause] += paused_ns;
  parts[MissCause::database] += database_ns;
  parts[run.major_faults > 0 ? MissCause::page_fault : MissCause::preempted] += off_cpu_ns;
  const std::int64_t allowed_ns = run.budget_ns > 0 ? run.budget_ns : run.deadline_ns;
  parts[MissCause::own_work] += span_ns(allowed_ns, cpu_ns);
}

}  // namespace

const char* to_string(MissCause cause) noexcept {
  switch (cause) {
    case MissCause::late_wake_up:
      return "late wake-up";
    case MissCause::own_work:
      return "own work";
    case MissCause::database:
      return "database";
    case MissCause::earlier_task:
      return "earlier task";
    case MissCause::preempted:
      return "preempted";
    case MissCause::page_fault:
      return "page fault";
    case MissCause::host_pause:
      return "host pause";
  }
  return "unknown";
}

MissCause DelayParts::largest() const noexcept {
  const auto found = std::max_element(parts_ns_.begin(), parts_ns_.end());
  return *found == 0 ? MissCause::own_work : static_cast<MissCause>(found - parts_ns_.begin());
}

DelayParts attribute_delay(const RunEvidence& run) noexcept {
  DelayParts parts;
  attribute_wait(run, parts);
  attribute_step(run, parts);
  return parts;
}

}  // namespace hil::executive
