#include "rtstdb/transaction/query_execution.hpp"

#include <algorithm>

#include <rtstdb/limits.hpp>

namespace rtstdb::transaction {
namespace {

Status cancelled(TransactionImpl& transaction) noexcept {
  transaction.draft().cancelled_by = CancelledBy::caller;
  return Status::cancelled;
}

/// Refuses a batch whose times span more than max_query_window_ns.
std::optional<BadInput> check_window(const store::TimeSpan& times) noexcept {
  if (times.first > times.last) return std::nullopt;
  // Unsigned: times that a query let through may be further apart than a signed difference can hold.
  const auto window_ns = static_cast<std::uint64_t>(times.last.time_since_epoch().count()) -
                         static_cast<std::uint64_t>(times.first.time_since_epoch().count());
  if (window_ns <= static_cast<std::uint64_t>(max_query_window_ns)) return std::nullopt;
  BadInput fault;
  fault.reason = BadInputReason::window_too_long;
  fault.values[0] = seconds_between(WorldTime{}, times.first);
  fault.values[1] = seconds_between(WorldTime{}, times.last);
  fault.values[2] = static_cast<double>(max_query_window_ns) * 1e-9;
  return fault;
}

/// Sets what a run leaves about the completeness of its answers.
void note_completeness(TransactionImpl& transaction, query::RunStatus status) noexcept {
  const auto lacks_some = [](const query::Request& request) {
    return request.query->answered() < request.count || request.query->incomplete(request.count) > 0;
  };
  const auto is_truncated = [](const query::Request& request) { return request.query->truncated(); };
  const bool ended_early = status == query::RunStatus::partial;
  Outcome& outcome = transaction.draft();
  outcome.partial = ended_early && std::ranges::any_of(transaction.requests(), lacks_some);
  // A run that ended early after its last chunk has all answers, and some may have overflowed.
  outcome.truncated = status == query::RunStatus::truncated || outcome.partial ||
                      (ended_early && std::ranges::any_of(transaction.requests(), is_truncated));
}

}  // namespace

std::optional<Status> QueryExecution::execute(TransactionImpl& transaction, const scheduler::Run& run,
                                              const store::RowSource& rows,
                                              query::ExecutorCallbacks* callbacks, QueryCost& cost) noexcept {
  Outcome& outcome = transaction.draft();
  transaction.answer_reads(rows);
  if (!transaction.has_queries()) {
    outcome.computed = clock_.now();
    return std::nullopt;
  }
  store::TimeSpan times;
  if (auto fault = check(transaction, rows, times)) {
    outcome.bad_input = *fault;
    return Status::bad_input;
  }
  divide(transaction);
  transaction.queried_version = {rows.version(), rows.time()};
  for (query::Request& request : transaction.requests()) {
    request.answered_in_time = 0;
    request.query->worst_cost_ratio = 0.0;
  }
  const Nanoseconds before = run.time.total(clock_.now());
  const query::RunReport report = executor_.run(rows, transaction.requests(), times, callbacks);
  outcome.computed = clock_.now();
  cost = {run.time.total(outcome.computed) - before, report.structures};
  // A device that the host times may have been idle for part of that.
  outcome.gpu_time = std::min(Nanoseconds(report.gpu_ns), cost.time);
  if (report.status == query::RunStatus::device_lost) return Status::device_lost;
  if (!clock_.is_virtual())
    costs_.update_from_worst_elements(transaction.requests(), cost.time, cost.structures);
  if (report.status == query::RunStatus::stopped) return stopped(transaction, run, cost);
  if (transaction.cancel_requested()) return cancelled(transaction);
  note_completeness(transaction, report.status);
  return std::nullopt;
}

void QueryExecution::divide(TransactionImpl& transaction) const noexcept {
  if (chunk_ > Nanoseconds(0) && !clock_.is_virtual()) {
    // Two chunks are in flight at a time.
    costs_.divide(transaction.requests(), chunk_ / 2);
    return;
  }
  for (query::Request& request : transaction.requests())
    request.per_chunk = 0;
}

Status QueryExecution::stopped(TransactionImpl& transaction, const scheduler::Run& run,
                               const QueryCost& cost) noexcept {
  if (transaction.cancel_requested()) return cancelled(transaction);
  if (run.must_restart) return Status::pending;
  if (!clock_.is_virtual()) costs_.update_from_stopped(transaction.requests(), cost.time, cost.structures);
  transaction.note_lateness(clock_.now());
  return Status::missed;
}

std::optional<BadInput> QueryExecution::check(TransactionImpl& transaction, const store::RowSource& rows,
                                              store::TimeSpan& times) noexcept {
  std::int32_t ordinal = 0;
  for (query::Request& request : transaction.requests()) {
    request.times = {};
    auto fault = request.query->check(request.count, rows, request.times);
    if (!fault) fault = check_window(request.times);
    if (fault) {
      transaction.draft().bad_query = ordinal;
      return fault;
    }
    times.first = std::min(times.first, request.times.first);
    times.last = std::max(times.last, request.times.last);
    ++ordinal;
  }
  if (times.first > times.last) times = {rows.time(), rows.time()};  // no request has an element
  return std::nullopt;
}

void QueryExecution::update_costs(TransactionImpl& transaction, const QueryCost& cost) noexcept {
  const auto requests = transaction.requests();
  if (requests.empty() || clock_.is_virtual()) return;
  const bool partial = transaction.ScheduledTransaction::outcome().partial;
  const auto declared = transaction.declared_counts();
  for (std::size_t k = 0; k < requests.size() && partial; ++k)
    requests[k].count = std::min(requests[k].count, requests[k].query->answered());
  costs_.update_from_queries(requests, cost.time, cost.structures);
  for (std::size_t k = 0; k < requests.size() && partial; ++k)
    requests[k].count = declared[k];
}

}  // namespace rtstdb::transaction
