#include "rtstdb/transaction/outcome_counts.hpp"

namespace rtstdb::transaction {

void OutcomeCounts::ended(Status status, const Outcome& outcome, const Terms& terms) noexcept {
  ended_[static_cast<std::size_t>(status)].fetch_add(1, std::memory_order_relaxed);
  if (status == Status::late && terms.deadline_class == DeadlineClass::hard) {
    hard_misses_.fetch_add(1, std::memory_order_relaxed);
  }
  if (outcome.refused_by == RefusedBy::log_full || outcome.refused_by == RefusedBy::log_fault)
    refused_by_log_.fetch_add(1, std::memory_order_relaxed);
  // Checked where every outcome passes, apart from the code that decides about lateness.
  if (is_done(status) && terms.deadline_class == DeadlineClass::firm && outcome.published > terms.deadline) {
    firm_late_commits_.fetch_add(1, std::memory_order_relaxed);
  }
}

TransactionCounts OutcomeCounts::read() const noexcept {
  TransactionCounts counts;
  counts.committed = ended_as(Status::committed);
  counts.truncated = ended_as(Status::truncated);
  counts.late = ended_as(Status::late);
  counts.missed = ended_as(Status::missed);
  counts.refused = ended_as(Status::refused);
  counts.conflicts = ended_as(Status::conflict);
  counts.cancelled = ended_as(Status::cancelled);
  counts.bad_input = ended_as(Status::bad_input);
  counts.device_lost = ended_as(Status::device_lost);
  counts.firm_late_commits = firm_late_commits_.load(std::memory_order_relaxed);
  counts.firm_delivered_late = firm_delivered_late_.load(std::memory_order_relaxed);
  counts.refused_by_log = refused_by_log_.load(std::memory_order_relaxed);
  counts.hard_misses = hard_misses_.load(std::memory_order_relaxed);
  counts.submitted = submitted_.load(std::memory_order_relaxed);
  return counts;
}

}  // namespace rtstdb::transaction
