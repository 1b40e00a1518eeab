#pragma once
// Counts of how transactions ended.
//
// Threads: any.

#include <array>
#include <atomic>
#include <cstdint>

#include <rtstdb/database.hpp>

namespace rtstdb::transaction {

class OutcomeCounts {
 public:
  void submitted() noexcept { submitted_.fetch_add(1, std::memory_order_relaxed); }
  /// A transaction with these terms has this outcome and is about to be given back.
  void ended(Status status, const Outcome& outcome, const Terms& terms) noexcept;
  /// Its owner got a firm commit after the deadline, although it was published before.
  void count_delivered_late() noexcept { firm_delivered_late_.fetch_add(1, std::memory_order_relaxed); }
  /// The counts are read one after the other: their sum is right once nothing is pending.
  TransactionCounts read() const noexcept;

 private:
  using Counter = std::atomic<std::uint64_t>;
  std::uint64_t ended_as(Status status) const noexcept {
    return ended_[static_cast<std::size_t>(status)].load(std::memory_order_relaxed);
  }

  Counter submitted_{0};
  std::array<Counter, static_cast<std::size_t>(Status::bad_input) + 1> ended_{};
  Counter firm_late_commits_{0};
  Counter firm_delivered_late_{0};
  Counter hard_misses_{0};
  Counter refused_by_log_{0};
};

}  // namespace rtstdb::transaction
