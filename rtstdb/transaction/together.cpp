// Small readers of one version that are ready together: one run of the executor for all of them, since what a submission
// costs of its own is most of what each of them would.
//
// Costs are not learned from such a run. They would be too low for one that runs alone, and promises with them. But one that takes
// longer than all were promised to teaches that, or they would go on together at the old price: the parts are wrong and the sum is
// right, by which they go alone next time.

#include <algorithm>
#include <span>

#include <rtstdb/limits.hpp>

#include "rtstdb/transaction/runner.hpp"

namespace rtstdb::transaction {
namespace {

/// The times of all lie within it: structures are made for the window of a run, and wide ones are dear to search.
constexpr Nanoseconds widest_window{max_query_window_ns / 8};

Nanoseconds part_of(Nanoseconds whole, Nanoseconds part, Nanoseconds of) noexcept {
  const double share = static_cast<double>(part.count()) / static_cast<double>(of.count());
  return Nanoseconds(static_cast<std::int64_t>(static_cast<double>(whole.count()) * share));
}

/// To those that take part.
Nanoseconds promised_together(const Running& running) noexcept {
  const auto promised = [](const TransactionImpl& one) {
    return one.shares ? one.promised_cost : Nanoseconds(0);
  };
  Nanoseconds sum = promised(*running.transaction);
  for (const TransactionImpl* other : running.others)
    sum += promised(*other);
  return sum;
}

}  // namespace

std::optional<Version> Runner::shared_version(const TransactionImpl& transaction) const noexcept {
  if (clock_.is_virtual() || transaction.promised_cost == Nanoseconds(0)) return std::nullopt;
  if (!transaction.write_set().empty() || transaction.requests().empty()) return std::nullopt;
  if (transaction.requests().size() > together_.size() / max_together) return std::nullopt;
  const auto found = store_.read(transaction.terms().read_at, store::ReadFor::rows_and_shapes);
  const auto* version = std::get_if<store::Snapshot>(&found);
  return version != nullptr ? std::optional(version->version()) : std::nullopt;
}

void Runner::read_together(std::span<TransactionImpl* const> readers, std::span<Status> statuses,
                           query::ExecutorCallbacks* callbacks) noexcept {
  const auto found = store_.read(readers[0]->terms().read_at, store::ReadFor::rows_and_shapes);
  const auto& version = *std::get_if<store::Snapshot>(&found);
  Running& running = running_.push(*readers[0]);
  running.others = readers.subspan(1);
  running.reading = version.version();
  requests_together_ = 0;
  store::TimeSpan times;
  std::uint32_t taking_part = 0;
  for (std::size_t k = 0; k < readers.size(); ++k) {
    statuses[k] = begin_together(*readers[k], version, times);
    taking_part += readers[k]->shares ? 1 : 0;
  }
  query::RunReport report;
  const ClockTime begun = clock_.now();
  if (taking_part > 0)
    report = executor_.run(version, std::span(together_).first(requests_together_), times, callbacks);
  const ClockTime computed = clock_.now();
  running.queries_cost = computed - begun - running.interrupted;
  const bool is_whole =
      report.status == query::RunStatus::done || report.status == query::RunStatus::truncated;
  if (is_whole && running.queries_cost > promised_together(running))
    costs_.learn_queries(std::span(together_).first(requests_together_), running.queries_cost,
                         report.structures);
  for (std::size_t k = 0; k < readers.size(); ++k) {
    if (!readers[k]->shares) continue;
    Outcome& outcome = readers[k]->draft();
    outcome.computed = computed;
    outcome.shared_with = taking_part - 1;
    statuses[k] = end_together(*readers[k], report, running, version);
    if (statuses[k] == Status::pending) outcome.shared_with = 0;
  }
  running_.pop();
}

Status Runner::begin_together(TransactionImpl& reader, const store::Snapshot& version,
                              store::TimeSpan& times) noexcept {
  Outcome& outcome = reader.draft();
  reader.shares = false;
  const ClockTime now = clock_.now();
  if (reader.is(DeadlineClass::firm) && now > reader.terms().deadline) {
    reader.note_late(now);
    return Status::missed;
  }
  outcome.started = now;
  if (!expectations_hold(reader, version)) return Status::conflict;
  store::TimeSpan own;
  if (auto fault = check_queries(reader, version, own)) {
    outcome.bad_input = *fault;
    return Status::bad_input;
  }
  const store::TimeSpan all{std::min(times.first, own.first), std::max(times.last, own.last)};
  const bool first = requests_together_ == 0;
  if (first && own.last - own.first > Nanoseconds(max_query_window_ns)) return Status::pending;
  if (!first && all.last - all.first > std::max(widest_window, times.last - times.first))
    return Status::pending;
  times = all;
  reader.answer_reads(version);
  reader.asked = {version.version(), version.time()};
  for (query::Request& request : reader.requests()) {
    request.per_chunk = 0;
    request.chunk_time = chunk_ > Nanoseconds(0) ? scheduler::CostModel::chunk_time(chunk_ / 2) : Nanoseconds(0);
    request.query->answered_in_time = 0;
    together_[requests_together_++] = request;
  }
  reader.shares = true;
  return Status::pending;
}

Status Runner::end_together(TransactionImpl& reader, const query::RunReport& report, const Running& running,
                            const store::Snapshot& version) noexcept {
  Outcome& outcome = reader.draft();
  if (report.status == query::RunStatus::device_lost) return Status::device_lost;
  if (reader.is_to_be_cancelled()) return cancelled(reader);
  const auto requests = reader.requests();
  const auto is_left = [](const query::Request& one) {
    return one.query->answered() < one.count || one.query->has_retries();
  };
  if (report.status == query::RunStatus::stopped && std::ranges::any_of(requests, is_left))
    return Status::pending;
  outcome.truncated =
      report.status != query::RunStatus::done &&
      std::ranges::any_of(requests, [](const query::Request& one) { return one.query->truncated(); });
  const Nanoseconds promised = promised_together(running);
  outcome.actual_cost = part_of(running.queries_cost, reader.promised_cost, promised);
  outcome.gpu_time =
      part_of(std::min(Nanoseconds(report.gpu_ns), running.queries_cost), reader.promised_cost, promised);
  outcome.interrupted = running.interrupted;
  const ClockTime now = clock_.now();
  if (outcome.shared_with == 0) outcome.actual_cost = now - outcome.started - outcome.interrupted;
  if (!is_in_time(reader, now)) return Status::missed;
  return done(reader, version);
}

}  // namespace rtstdb::transaction
