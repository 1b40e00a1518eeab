#include "rtstdb/transaction/held_transactions.hpp"

#include <utility>

#include <rtstdb/result.hpp>

namespace rtstdb::transaction {

void HeldTransactions::hold(TransactionImpl& transaction) noexcept {
  count_.fetch_add(1, std::memory_order_release);
  const bool open = given_.push(transaction);
  RTSTDB_ASSERT(open, "the queue of held transactions is closed");
}

void HeldTransactions::take_over() noexcept {
  *end_ = given_.take_all();
  while (*end_ != nullptr)
    end_ = &(*end_)->next;
}

TransactionImpl* HeldTransactions::release(Version durable, bool refused, const Clock& clock) noexcept {
  take_over();
  if (first_ == nullptr) return nullptr;
  auto& transaction = static_cast<TransactionImpl&>(*first_);
  const bool is_durable = transaction.ScheduledTransaction::outcome().version <= durable;
  if (!is_durable && !refused) return nullptr;
  first_ = std::exchange(transaction.next, nullptr);
  if (first_ == nullptr) end_ = &first_;
  count_.fetch_sub(1, std::memory_order_release);
  transaction.draft().durable = is_durable;
  if (is_durable) transaction.draft().durable_at = clock.now();
  return &transaction;
}

}  // namespace rtstdb::transaction
