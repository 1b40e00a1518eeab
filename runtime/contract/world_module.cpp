#include <hil/world/world_module.hpp>

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

SetupError::Fault fault_of(rtstdb::ErrorCode code) {
  switch (code) {
    case rtstdb::ErrorCode::out_of_memory:
      return SetupError::Fault::memory;
    case rtstdb::ErrorCode::file:
      return SetupError::Fault::file;
    case rtstdb::ErrorCode::no_device:
    case rtstdb::ErrorCode::device_lost:
      return SetupError::Fault::device;
    case rtstdb::ErrorCode::bad_input:
    case rtstdb::ErrorCode::capacity:
      break;
  }
  return SetupError::Fault::scenario;
}

}  // namespace

const rtstdb::Outcome& WorldStep::execute(rtstdb::Database& database,
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

RefusedByDatabase::RefusedByDatabase(const std::string& caller, const rtstdb::Error& error)
    : SetupError(caller + ": " + error.message, fault_of(error.code)) {}

}  // namespace hil::modules
