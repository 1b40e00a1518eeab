#include "runtime/executive/task.hpp"

namespace hil::executive {
namespace {

std::string in_ns(std::int64_t value_ns) {
  return std::to_string(value_ns) + " ns";
}

}  // namespace

std::int64_t effective_deadline_ns(const TaskSpec& spec, std::int64_t base_period_ns) noexcept {
  return spec.deadline_ns == 0 ? base_period_ns * spec.every_ticks : spec.deadline_ns;
}

std::optional<std::string> why_refused(const TaskSpec& spec, std::int64_t base_period_ns) {
  if (spec.name.empty()) return "a task needs a name";
  const std::string subject = "task '" + spec.name + "': ";
  if (spec.every_ticks == 0) return subject + "runs every 0 ticks; at least 1";
  if (spec.offset_ticks >= spec.every_ticks) {
    return subject + "offset of " + std::to_string(spec.offset_ticks) + " ticks; it runs every " +
           std::to_string(spec.every_ticks) + ", so at most " + std::to_string(spec.every_ticks - 1);
  }
  const std::int64_t period_ns = base_period_ns * spec.every_ticks;
  const std::int64_t deadline_ns = effective_deadline_ns(spec, base_period_ns);
  if (deadline_ns < 0 || deadline_ns > period_ns) {
    return subject + "deadline of " + in_ns(deadline_ns) + "; from 0 to its period of " + in_ns(period_ns);
  }
  if (!spec.thread.empty() && deadline_ns % base_period_ns != 0) {
    return subject + "deadline of " + in_ns(deadline_ns) +
           "; on a thread of its own it must be a multiple of the base period of " + in_ns(base_period_ns);
  }
  if (spec.budget_ns < 0 || spec.budget_ns > deadline_ns) {
    return subject + "budget of " + in_ns(spec.budget_ns) + "; from 0 to its deadline of " +
           in_ns(deadline_ns);
  }
  if (spec.overrun == OverrunPolicy::abort && spec.thread.empty()) {
    return subject +
           "overrun policy abort needs a thread of its own, since no other thread could abort it on the base "
           "thread";
  }
  return std::nullopt;
}

}  // namespace hil::executive
