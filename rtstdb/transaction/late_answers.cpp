#include "rtstdb/transaction/late_answers.hpp"

#include <algorithm>

namespace rtstdb::transaction::late_answers {
namespace {

bool may_be_partial(const query::Request& request) noexcept {
  return request.query->late() == LatePolicy::partial;
}

bool may_be_partial(const scheduler::ScheduledTransaction& transaction) noexcept {
  return transaction.terms().deadline != ClockTime::max() && !transaction.writes() &&
         std::ranges::any_of(transaction.requests(),
                             [](const auto& request) { return may_be_partial(request); });
}

void publish_answers(const query::Request& request, std::uint32_t answered,
                     const TransactionImpl& transaction) noexcept {
  answered = std::min(answered, request.count);
  const std::uint32_t missing = request.count - answered + request.query->incomplete(answered);
  request.query->publish_answers(answered, request.count);
  const VersionInfo version = transaction.queried_version;
  request.query->info = {.elements = request.count,
                         .missing = missing,
                         .version = version.version,
                         .version_time = version.time,
                         .published = transaction.ScheduledTransaction::outcome().published};
}

}  // namespace

void begin_point(scheduler::Run& run, const Clock& clock) noexcept {
  scheduler::ScheduledTransaction& transaction = *run.transaction;
  if (!may_be_partial(transaction)) return;
  const ClockTime now = clock.now();
  run.last_chunk = now - run.resumed_at.value_or(transaction.ScheduledTransaction::outcome().started);
  if (now > transaction.terms().deadline) return;
  for (query::Request& request : transaction.requests())
    request.answered_in_time = request.query->answered();
}

bool ends_in_time(scheduler::Run& run, const Clock& clock) noexcept {
  const scheduler::ScheduledTransaction& transaction = *run.transaction;
  if (!may_be_partial(transaction)) return false;
  const ClockTime now = clock.now();
  run.resumed_at = now;
  if (now + run.last_chunk <= transaction.terms().deadline) return false;
  // Without an answer there is nothing to publish.
  if (std::ranges::all_of(transaction.requests(),
                          [](const query::Request& request) { return request.query->answered() == 0; }))
    return false;
  return std::ranges::all_of(transaction.requests(), [](const query::Request& request) {
    const query::PreparedQuery& query = *request.query;
    return may_be_partial(request) || (query.answered() >= request.count && !query.has_retries());
  });
}

void settle(TransactionImpl& transaction, Status status, const Clock& clock) noexcept {
  Outcome& outcome = transaction.draft();
  const bool done = is_done(status);
  const bool keeps_partial = status == Status::missed && may_be_partial(transaction);
  if (!done) outcome.partial = false;  // unless answers of a preemption point are kept below
  for (const query::Request& request : transaction.requests()) {
    query::PreparedQuery& query = *request.query;
    if (done) {
      publish_answers(request, outcome.partial ? query.answered() : request.count, transaction);
    } else if (keeps_partial && may_be_partial(request) && request.answered_in_time > 0) {
      publish_answers(request, request.answered_in_time, transaction);
      outcome.partial = true;
    } else {
      query.discard_answers();
      if (query.late() != LatePolicy::last_good) query.info = {};
      if (query.info.elements == 0) continue;
      query.info.stale = true;
      query.info.age = clock.now() - query.info.published;
      outcome.stale = true;
    }
  }
}

}  // namespace rtstdb::transaction::late_answers
