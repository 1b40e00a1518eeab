#include "runtime/modules/module.hpp"

#include <algorithm>

namespace hil::modules {

namespace {

const char* cause_of_lateness(const rtstdb::Outcome& outcome) {
  if (outcome.submitted > outcome.published - outcome.lateness) return "submitted after its deadline";
  const rtstdb::Nanoseconds waited = outcome.started - outcome.submitted, interrupted = outcome.interrupted,
                            worked = outcome.published - outcome.started - interrupted;
  if (waited >= interrupted && waited >= worked) return "waited for other transactions";
  return interrupted >= worked ? "interrupted by other transactions" : "own work";
}

/// A transaction that has no result has no instant of publication.
std::int64_t waited_ns(const rtstdb::Outcome& outcome, rtstdb::ClockTime deadline) {
  if (outcome.done()) return (outcome.published - outcome.submitted).count();
  if (outcome.status != rtstdb::Status::missed) return 0;
  return (deadline + outcome.lateness - outcome.submitted).count();
}

}  // namespace

const rtstdb::Outcome& StepContext::execute(rtstdb::Database& database,
                                            rtstdb::Transaction& transaction) noexcept {
  const rtstdb::Outcome& outcome = database.execute(transaction);
  blocked_ns += waited_ns(outcome, deadline);
  gpu_ns += outcome.gpu_time.count();
  if (!outcome.done() && failure == rtstdb::Status::idle) failure = outcome.status;
  discarded |=
      outcome.status == rtstdb::Status::missed || (outcome.deadline_class == rtstdb::DeadlineClass::firm &&
                                                   outcome.refused_by == rtstdb::RefusedBy::admission);
  if (outcome.status == rtstdb::Status::late && outcome.deadline_class == rtstdb::DeadlineClass::hard &&
      outcome.lateness.count() > hard_miss.lateness_ns)
    hard_miss = {outcome.lateness.count(), cause_of_lateness(outcome)};
  return outcome;
}

const ModuleType* find_module_type(const std::string& name) {
  const auto& types = module_types();
  const auto found =
      std::find_if(types.begin(), types.end(), [&](const ModuleType& type) { return type.name == name; });
  return found == types.end() ? nullptr : &*found;
}

}  // namespace hil::modules
