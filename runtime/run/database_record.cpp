#include "runtime/run/database_record.hpp"

namespace hil::run {

report::Scheduler scheduler_of(const rtstdb::SchedulerCounts& counts) {
  report::Scheduler scheduler;
  scheduler.promised = counts.promised;
  scheduler.kept = counts.kept;
  scheduler.outranked = counts.outranked;
  scheduler.restarts = counts.restarts;
  for (const rtstdb::CostPredictions& one : counts.predictions)
    scheduler.predicted_over_actual.push_back(
        {std::string(one.cost_class), one.count, one.p01, one.median, one.p99});
  for (const rtstdb::ReservationCounts& one : counts.reservations) {
    scheduler.reservations.push_back({.name = one.options.name,
                                      .period_ns = one.options.period.count(),
                                      .deadline_ns = one.options.deadline.count(),
                                      .budget_ns = one.options.budget.count(),
                                      .transactions = one.transactions,
                                      .kept = one.kept,
                                      .broken = one.broken,
                                      .too_often = one.too_often,
                                      .too_long = one.too_long,
                                      .largest_cost_ns = one.largest_cost.count(),
                                      .longest_response_ns = one.longest_response.count()});
  }
  return scheduler;
}

report::Transactions transactions_of(const rtstdb::TransactionCounts& counts) {
  report::Transactions transactions;
  transactions.submitted = counts.submitted;
  transactions.committed = counts.committed;
  transactions.late = counts.late;
  transactions.missed = counts.missed;
  transactions.refused = counts.refused;
  transactions.conflicts = counts.conflicts;
  transactions.cancelled = counts.cancelled;
  transactions.truncated = counts.truncated;
  transactions.device_lost = counts.device_lost;
  transactions.bad_input = counts.bad_input;
  transactions.firm_late_commits = counts.firm_late_commits;
  transactions.hard_misses = counts.hard_misses;
  return transactions;
}

report::DatabaseLog database_log_of(const rtstdb::Durability& durability, rtstdb::Version latest,
                                    const rtstdb::TransactionCounts& counts) {
  report::DatabaseLog log;
  log.durability = rtstdb::to_string(durability.mode);
  log.refused_transactions = counts.refused_by_log;
  log.latest_version = latest;
  log.durable_version = durability.durable;
  log.bytes = durability.bytes;
  log.groups = durability.groups;
  log.segments = durability.segments;
  log.checkpoints = durability.checkpoints;
  log.longest_write_ns = durability.longest_write.count();
  log.all_writes_ns = durability.all_writes.count();
  log.ring_bytes = durability.ring_bytes;
  log.ring_high_water_bytes = durability.ring_high_water;
  log.gaps = durability.gaps;
  log.commits_in_gaps = durability.commits_in_gaps;
  log.faults = durability.faults;
  log.last_fault = durability.last_fault;
  return log;
}

}  // namespace hil::run
