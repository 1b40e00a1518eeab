#include "rtstdb/transaction/commit_path.hpp"

#include <optional>
#include <variant>

namespace rtstdb::transaction {

Status CommitPath::execute(TransactionImpl& transaction, query::ExecutorCallbacks* callbacks) noexcept {
  const ClockTime now = parts_.clock.now();
  if (transaction.is(DeadlineClass::firm) && now > transaction.terms().deadline) {
    transaction.note_lateness(now);
    return Status::missed;
  }
  transaction.draft().started = now;
  scheduler::Run& run = parts_.runs.push(transaction, now);
  const Status status =
      transaction.writes() ? write(transaction, run, callbacks) : read(transaction, run, callbacks);
  parts_.runs.pop();
  return status;
}

Status CommitPath::write(TransactionImpl& transaction, scheduler::Run& run,
                         query::ExecutorCallbacks* callbacks) noexcept {
  if (!preconditions_hold(transaction, parts_.store.latest_snapshot())) return Status::conflict;
  if (const auto refused =
          parts_.log != nullptr ? parts_.log->refuses(transaction.write_set()) : std::nullopt) {
    transaction.draft().refused_by = *refused;
    return Status::refused;
  }
  if (auto fault = parts_.store.stage(transaction.write_set())) {
    transaction.draft().bad_input = *fault;
    return Status::bad_input;
  }
  run.staged = true;
  const store::Snapshot version = parts_.store.staged_snapshot();
  QueryCost cost;
  if (auto failure = parts_.queries.execute(transaction, run, version, callbacks, cost)) {
    parts_.store.discard();
    return *failure;
  }
  if (parts_.log != nullptr && parts_.log->mode() == DurabilityMode::sync)
    return publish_durably(transaction, run, cost, version);
  return publish(transaction, run, cost, version);
}

Status CommitPath::publish(TransactionImpl& transaction, const scheduler::Run& run, const QueryCost& cost,
                           const store::RowSource& version) noexcept {
  parts_.store.publish();
  if (!published_in_time(transaction, run, cost)) {
    parts_.store.discard();
    return Status::missed;
  }
  if (parts_.log != nullptr) parts_.log->record(transaction.write_set());
  const Status status = done(transaction, version);
  parts_.store.complete_commit();
  return status;
}

Status CommitPath::publish_durably(TransactionImpl& transaction, const scheduler::Run& run,
                                   const QueryCost& cost, const store::RowSource& version) noexcept {
  Outcome& outcome = transaction.draft();
  if (transaction.is(DeadlineClass::firm) && parts_.clock.now() > transaction.terms().deadline) {
    transaction.note_lateness(parts_.clock.now());
    parts_.store.discard();
    return Status::missed;
  }
  const bool on_disk = parts_.log->write_through(transaction.write_set());
  if (on_disk) parts_.store.publish();
  if (!on_disk || !published_in_time(transaction, run, cost)) {
    parts_.store.discard();
    outcome.in_doubt = !parts_.log->take_back(version.version());
    if (outcome.in_doubt) outcome.version = version.version();
    if (on_disk) return Status::missed;
    outcome.refused_by = RefusedBy::log_fault;
    return Status::refused;
  }
  outcome.durable = true;
  outcome.durable_at = outcome.published;
  const Status status = done(transaction, version);
  parts_.store.complete_commit();
  return status;
}

Status CommitPath::read(TransactionImpl& transaction, scheduler::Run& run,
                        query::ExecutorCallbacks* callbacks) noexcept {
  const auto purpose = transaction.has_queries() ? store::ReadFor::rows_and_shapes : store::ReadFor::rows;
  const auto found = parts_.store.read(transaction.terms().read_at, purpose);
  if (const auto* fault = std::get_if<BadInput>(&found)) {
    transaction.draft().bad_input = *fault;
    return Status::bad_input;
  }
  const auto& version = *std::get_if<store::Snapshot>(&found);
  if (!preconditions_hold(transaction, version)) return Status::conflict;
  run.reading = version.version();
  QueryCost cost;
  if (const auto failure = parts_.queries.execute(transaction, run, version, callbacks, cost))
    return *failure;
  if (!published_in_time(transaction, run, cost)) return Status::missed;
  return done(transaction, version);
}

bool CommitPath::preconditions_hold(TransactionImpl& transaction, const store::RowSource& rows) noexcept {
  std::uint32_t ordinal = 0;
  for (const Precondition& expected : transaction.preconditions()) {
    const EntityState* state = rows.find(expected.entity);
    if (state == nullptr || (!expected.any_version && state->written_by != expected.written_by)) {
      Outcome& outcome = transaction.draft();
      outcome.conflict = {ordinal, expected.entity, state != nullptr,
                          state != nullptr ? state->written_by : 0};
      outcome.version = rows.version();
      outcome.version_time = rows.time();
      return false;
    }
    ++ordinal;
  }
  return true;
}

ClockTime CommitPath::note_cost(TransactionImpl& transaction, const scheduler::Run& run,
                                const QueryCost& cost) noexcept {
  Outcome& outcome = transaction.draft();
  const ClockTime now = parts_.clock.now();
  outcome.actual_cost = run.time.total(now);
  outcome.interrupted = now - outcome.started - outcome.actual_cost;
  if (!parts_.clock.is_virtual()) {
    parts_.costs.update_from_writes(transaction.write_set(), outcome.actual_cost - cost.time);
    parts_.queries.update_costs(transaction, cost);
  }
  return now;
}

bool CommitPath::published_in_time(TransactionImpl& transaction, const scheduler::Run& run,
                                   const QueryCost& cost) noexcept {
  const ClockTime now = note_cost(transaction, run, cost);
  if (transaction.is(DeadlineClass::firm) && now > transaction.terms().deadline) {
    transaction.note_lateness(now);
    return false;
  }
  transaction.draft().published = now;
  return true;
}

Status CommitPath::done(TransactionImpl& transaction, const store::RowSource& rows) noexcept {
  Outcome& outcome = transaction.draft();
  outcome.version = rows.version();
  outcome.version_time = rows.time();
  const bool may_be_late = transaction.is(DeadlineClass::hard) || transaction.is(DeadlineClass::soft);
  if (may_be_late && outcome.published > transaction.terms().deadline) {
    transaction.note_lateness(outcome.published);
    return Status::late;
  }
  return outcome.truncated ? Status::truncated : Status::committed;
}

// ---- calibration

Status CommitPath::calibrate(TransactionImpl& transaction) noexcept {
  constexpr std::uint32_t parts = 4;
  std::uint32_t part = 0;
  Status status = Status::committed;
  for (std::uint64_t k = 0; k < scheduler::CostModel::min_samples && status == Status::committed; ++k) {
    part = part % parts + 1;
    transaction.scale_requests(part, parts);
    status = execute_unpublished(transaction);
    transaction.scale_requests(1, 1);
  }
  for (const query::Request& request : transaction.requests()) {
    request.query->discard_answers();
    if (request.query->late() != LatePolicy::last_good) request.query->info = {};
  }
  return status;
}

Status CommitPath::execute_unpublished(TransactionImpl& transaction) noexcept {
  /// Divides batches as usual, and preempts nothing.
  class NoPreemption final : public query::ExecutorCallbacks {
   public:
    void begin_wait() noexcept override {}
    void end_wait() noexcept override {}
    Continuation on_preemption_point() noexcept override { return Continuation::go_on; }
  } alone;
  transaction.draft().started = parts_.clock.now();
  const bool writes = transaction.writes();
  std::optional<store::Snapshot> version;
  if (writes) {
    if (!preconditions_hold(transaction, parts_.store.latest_snapshot())) return Status::conflict;
    if (const auto fault = parts_.store.stage(transaction.write_set())) {
      transaction.draft().bad_input = *fault;
      return Status::bad_input;
    }
    version = parts_.store.staged_snapshot();
  } else {
    const auto found = parts_.store.read(transaction.terms().read_at, store::ReadFor::rows_and_shapes);
    if (const auto* fault = std::get_if<BadInput>(&found)) {
      transaction.draft().bad_input = *fault;
      return Status::bad_input;
    }
    version = *std::get_if<store::Snapshot>(&found);
    if (!preconditions_hold(transaction, *version)) return Status::conflict;
  }
  scheduler::Run& run = parts_.runs.push(transaction, transaction.ScheduledTransaction::outcome().started);
  QueryCost cost;
  const auto failure = parts_.queries.execute(transaction, run, *version, &alone, cost);
  // Published and discarded under the lock: a version without readers costs what a commit costs.
  if (writes) parts_.store.publish();
  if (!failure) note_cost(transaction, run, cost);
  if (writes) parts_.store.discard();
  parts_.runs.pop();
  return failure.value_or(Status::committed);
}

}  // namespace rtstdb::transaction
