#pragma once
// Group mode: transactions that are committed and wait until the disk has their version, by ascending
// version.
//
// Threads: hold by the engine's, count by any, all else by the log's.

#include <atomic>
#include <cstdint>

#include <rtstdb/time.hpp>

#include "rtstdb/scheduler/hand_over.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

class HeldTransactions {
 public:
  /// The transaction is done and has its status in its outcome. It is held from now on.
  void hold(TransactionImpl& transaction) noexcept;
  std::uint32_t count() const noexcept { return count_.load(std::memory_order_acquire); }

  /// Takes the next transaction whose version is at most `durable`, or, where the disk refuses, the next one;
  /// null: none. Its outcome says whether and since when (`now`) it is durable.
  TransactionImpl* release(Version durable, bool refused, const Clock& clock) noexcept;

 private:
  void take_over() noexcept;

  scheduler::HandOver given_;
  std::atomic<std::uint32_t> count_{0};
  scheduler::HandOverLink* first_ = nullptr;
  scheduler::HandOverLink** end_ = &first_;
};

}  // namespace rtstdb::transaction
