// The engine and its log: what the log's thread asks for, and how writers go through it to the disk.

#include "rtstdb/transaction/engine.hpp"

namespace rtstdb::transaction {

// ---- the engine's thread

bool Engine::is_held(const TransactionImpl& transaction, Status status) const noexcept {
  if (log_ == nullptr || log_->mode() != DurabilityMode::group || transaction.write_set().empty())
    return false;
  return is_done(status);
}

Status Runner::write_through(TransactionImpl& transaction, const Running& running,
                             const store::RowSource& version) noexcept {
  Outcome& outcome = transaction.draft();
  const ClockTime deadline = transaction.terms().deadline;
  if (transaction.is(DeadlineClass::firm) && clock_.now() > deadline) {
    transaction.note_late(clock_.now());
    store_.discard();
    return Status::missed;
  }
  const bool on_disk = log_->write_through(transaction.write_set());
  if (on_disk) store_.publish();
  if (!on_disk || !published_in_time(transaction, running)) {
    store_.discard();
    outcome.in_doubt = !log_->take_back(version.version());
    if (outcome.in_doubt) outcome.version = version.version();
    if (on_disk) return Status::missed;
    outcome.refused_by = RefusedBy::log_fault;
    return Status::refused;
  }
  outcome.durable = true;
  outcome.durable_at = outcome.published;
  const Status status = done(transaction, version);
  store_.settle();
  return status;
}

// ---- the log's thread

void Engine::take_job(EngineJob& job) noexcept {
  if (jobs_given_.push(job)) return ring();
  // The engine's thread has ended, or carries out the last jobs.
  const std::lock_guard lock(working_);
  while (!job.step(store_)) {
  }
  job.mark_done();
}

void Engine::give_back_held(TransactionImpl& transaction) noexcept {
  const Status status = transaction.outcome().status;
  tally_.ended(status, transaction.outcome(), transaction.terms());
  Reservations::given_back(transaction);
  transaction.finish(status);  // from here on it may be gone
}

}  // namespace rtstdb::transaction
