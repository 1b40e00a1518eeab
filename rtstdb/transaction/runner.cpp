#include "rtstdb/transaction/runner.hpp"

#include <algorithm>
#include <utility>
#include <variant>

#include <rtstdb/limits.hpp>

namespace rtstdb::transaction {

Status Runner::run(TransactionImpl& transaction, query::ExecutorCallbacks* callbacks) noexcept {
  Outcome& outcome = transaction.draft();
  const Terms& terms = transaction.terms();
  const ClockTime now = clock_.now();
  if (transaction.is(DeadlineClass::firm) && now > terms.deadline) {
    transaction.note_late(now);
    return Status::missed;
  }
  outcome.started = now;
  Running& running = running_.push(transaction);
  const Status status = transaction.write_set().empty() ? read(transaction, running, callbacks)
                                                        : write(transaction, running, callbacks);
  running_.pop();
  return status;
}

Status Runner::rehearse(TransactionImpl& transaction) noexcept {
  constexpr std::uint32_t parts = 4;
  std::uint32_t part = 0;
  Status status = Status::committed;
  for (std::uint64_t k = 0; k < scheduler::CostModel::min_samples && status == Status::committed; ++k) {
    part = part % parts + 1;
    transaction.ask_parts(part, parts);
    status = rehearse_once(transaction);
    transaction.ask_parts(1, 1);
  }
  for (const query::Request& request : transaction.requests()) {
    request.query->discard_answers();
    if (request.query->late() != LatePolicy::last_good) request.query->info = {};
  }
  return status;
}

Status Runner::rehearse_once(TransactionImpl& transaction) noexcept {
  /// Divides batches as they will be, and lets nobody in.
  class Alone final : public query::ExecutorCallbacks {
   public:
    void begin_wait() noexcept override {}
    void end_wait() noexcept override {}
    Gap on_preemption_point() noexcept override { return Gap::go_on; }
  } alone;
  transaction.draft().started = clock_.now();
  const bool writes = !transaction.write_set().empty();
  std::optional<store::Snapshot> version;
  if (writes) {
    if (!expectations_hold(transaction, store_.latest_snapshot())) return Status::conflict;
    if (const auto fault = store_.stage(transaction.write_set())) {
      transaction.draft().bad_input = *fault;
      return Status::bad_input;
    }
    version = store_.staged_snapshot();
  } else {
    const auto found = store_.read(transaction.terms().read_at, store::ReadFor::rows_and_shapes);
    if (const auto* fault = std::get_if<BadInput>(&found)) {
      transaction.draft().bad_input = *fault;
      return Status::bad_input;
    }
    version = *std::get_if<store::Snapshot>(&found);
    if (!expectations_hold(transaction, *version)) return Status::conflict;
  }
  Running& running = running_.push(transaction);
  const auto failure = answer(transaction, running, *version, &alone);
  if (writes) store_.publish();
  if (!failure) note_cost(transaction, running);
  if (writes) store_.discard();
  running_.pop();
  return failure.value_or(Status::committed);
}

bool Runner::fits_beside(const TransactionImpl& transaction) const noexcept {
  if (transaction.write_set().empty()) return true;
  return !running_.one_is_staged() && std::ranges::all_of(running_.all(), [&](const Running& running) {
    return !running.reading || store_.keeps_after(*running.reading, transaction.write_set());
  });
}

Status Runner::write(TransactionImpl& transaction, Running& running,
                     query::ExecutorCallbacks* callbacks) noexcept {
  if (!expectations_hold(transaction, store_.latest_snapshot())) return Status::conflict;
  if (const auto refused = log_ != nullptr ? log_->refuses(transaction.write_set()) : std::nullopt) {
    transaction.draft().refused_by = *refused;
    return Status::refused;
  }
  if (auto fault = store_.stage(transaction.write_set())) {
    transaction.draft().bad_input = *fault;
    return Status::bad_input;
  }
  running.staged = true;
  const store::Snapshot version = store_.staged_snapshot();
  if (auto failure = answer(transaction, running, version, callbacks)) {
    store_.discard();
    return *failure;
  }
  if (log_ != nullptr && log_->mode() == DurabilityMode::sync)
    return write_through(transaction, running, version);
  store_.publish();
  if (!published_in_time(transaction, running)) {
    store_.discard();
    return Status::missed;
  }
  if (log_ != nullptr) log_->record(transaction.write_set());
  const Status status = done(transaction, version);
  store_.settle();
  return status;
}

Status Runner::read(TransactionImpl& transaction, Running& running,
                    query::ExecutorCallbacks* callbacks) noexcept {
  const auto purpose =
      transaction.requests().empty() ? store::ReadFor::rows : store::ReadFor::rows_and_shapes;
  const auto found = store_.read(transaction.terms().read_at, purpose);
  if (const auto* fault = std::get_if<BadInput>(&found)) {
    transaction.draft().bad_input = *fault;
    return Status::bad_input;
  }
  const auto& version = *std::get_if<store::Snapshot>(&found);
  if (!expectations_hold(transaction, version)) return Status::conflict;
  running.reading = version.version();
  if (const auto failure = answer(transaction, running, version, callbacks)) return *failure;
  if (!published_in_time(transaction, running)) return Status::missed;
  return done(transaction, version);
}

bool Runner::expectations_hold(TransactionImpl& transaction, const store::RowSource& rows) noexcept {
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

std::optional<Status> Runner::answer(TransactionImpl& transaction, Running& running,
                                     const store::RowSource& rows,
                                     query::ExecutorCallbacks* callbacks) noexcept {
  Outcome& outcome = transaction.draft();
  transaction.answer_reads(rows);
  if (transaction.requests().empty()) {
    outcome.computed = clock_.now();
    return std::nullopt;
  }
  store::TimeSpan times;
  if (auto fault = check_queries(transaction, rows, times)) {
    outcome.bad_input = *fault;
    return Status::bad_input;
  }
  divide(transaction);
  transaction.asked = {rows.version(), rows.time()};
  for (const query::Request& request : transaction.requests()) {
    request.query->answered_in_time = 0;
    request.query->worst_cost_ratio = 0.0;
  }
  const ClockTime begun = clock_.now();
  const query::RunReport report = executor_.run(rows, transaction.requests(), times, callbacks);
  outcome.computed = clock_.now();
  running.queries_cost = outcome.computed - begun - running.interrupted;
  running.structures = report.structures;
  // A device that the host times may have been done before it was looked at.
  outcome.gpu_time = std::min(Nanoseconds(report.gpu_ns), running.queries_cost);
  if (report.status == query::RunStatus::device_lost) return Status::device_lost;
  if (!clock_.is_virtual())
    costs_.learn_worst_elements(transaction.requests(), running.queries_cost, report.structures);
  if (report.status == query::RunStatus::stopped) return stopped(transaction, running);
  if (transaction.is_to_be_cancelled()) return cancelled(transaction);
  const auto lacks_some = [](const query::Request& request) {
    return request.query->answered() < request.count || request.query->incomplete(request.count) > 0;
  };
  outcome.partial =
      report.status == query::RunStatus::partial && std::ranges::any_of(transaction.requests(), lacks_some);
  // One that was ended with its last chunk may have overflowed.
  const auto is_truncated = [](const query::Request& request) { return request.query->truncated(); };
  outcome.truncated = report.status == query::RunStatus::truncated || outcome.partial ||
                      (report.status == query::RunStatus::partial &&
                       std::ranges::any_of(transaction.requests(), is_truncated));
  return std::nullopt;
}

void Runner::divide(TransactionImpl& transaction) const noexcept {
  if (chunk_ > Nanoseconds(0) && !clock_.is_virtual()) {
    costs_.divide(transaction.requests(), chunk_ / 2);
    return;
  }
  for (query::Request& request : transaction.requests())
    request.per_chunk = 0;
}

Status Runner::cancelled(TransactionImpl& transaction) noexcept {
  transaction.draft().cancelled_by = CancelledBy::caller;
  return Status::cancelled;
}

Status Runner::stopped(TransactionImpl& transaction, const Running& running) noexcept {
  if (transaction.is_to_be_cancelled()) return cancelled(transaction);
  if (running.must_restart) return Status::pending;
  if (!clock_.is_virtual())
    costs_.learn_stopped(transaction.requests(), running.queries_cost, running.structures);
  transaction.note_late(clock_.now());
  return Status::missed;
}

std::optional<BadInput> Runner::check_queries(TransactionImpl& transaction, const store::RowSource& rows,
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
  if (times.first > times.last) times = {rows.time(), rows.time()};  // no element asked
  return std::nullopt;
}

std::optional<BadInput> Runner::check_window(const store::TimeSpan& times) noexcept {
  if (times.first > times.last) return std::nullopt;
  // Unsigned: times that a query let through may be further apart than a signed difference can say.
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

void Runner::learn_queries(TransactionImpl& transaction, const Running& running) noexcept {
  const auto requests = transaction.requests();
  if (requests.empty()) return;
  const auto asked = transaction.asked_counts();
  if (transaction.outcome().partial) {
    for (query::Request& request : requests)
      request.count = std::min(request.count, request.query->answered());
  }
  costs_.learn_queries(requests, running.queries_cost, running.structures);
  for (std::size_t k = 0; k < requests.size() && transaction.outcome().partial; ++k)
    requests[k].count = asked[k];
}

ClockTime Runner::note_cost(TransactionImpl& transaction, const Running& running) noexcept {
  Outcome& outcome = transaction.draft();
  const ClockTime now = clock_.now();
  outcome.interrupted = running.interrupted;
  outcome.actual_cost = now - outcome.started - running.interrupted;
  if (!clock_.is_virtual()) {
    costs_.learn_writes(transaction.write_set(), outcome.actual_cost - running.queries_cost);
    learn_queries(transaction, running);
  }
  return now;
}

bool Runner::published_in_time(TransactionImpl& transaction, const Running& running) noexcept {
  return is_in_time(transaction, note_cost(transaction, running));
}

bool Runner::is_in_time(TransactionImpl& transaction, ClockTime now) noexcept {
  Outcome& outcome = transaction.draft();
  const ClockTime deadline = transaction.terms().deadline;
  if (transaction.is(DeadlineClass::firm) && now > deadline) {
    transaction.note_late(now);
    return false;
  }
  outcome.published = now;
  return true;
}

Status Runner::done(TransactionImpl& transaction, const store::RowSource& rows) noexcept {
  Outcome& outcome = transaction.draft();
  outcome.version = rows.version();
  outcome.version_time = rows.time();
  const ClockTime deadline = transaction.terms().deadline;
  const bool may_be_late = transaction.is(DeadlineClass::hard) || transaction.is(DeadlineClass::soft);
  if (may_be_late && outcome.published > deadline) {
    transaction.note_late(outcome.published);
    return Status::late;
  }
  return outcome.truncated ? Status::truncated : Status::committed;
}

}  // namespace rtstdb::transaction
