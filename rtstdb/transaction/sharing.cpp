// Who shares a run: the engine's choice among those that wait. What a shared run is: together.cpp.
//
// Those that follow one another in the order alone, so that nobody goes before his turn; together no more than a chunk, so
// that nobody more urgent waits for longer; and only as long as all are in time. Reserved ones share with reserved ones.

#include <algorithm>

#include "rtstdb/transaction/engine.hpp"

namespace rtstdb::transaction {
namespace {

ClockTime latest_end(const TransactionImpl& transaction) noexcept {
  return transaction.reserved ? transaction.due : transaction.terms().deadline;
}

}  // namespace

std::size_t Engine::gather(TransactionImpl& first, const TransactionImpl* interrupted,
                           Together& together) noexcept {
  together[0] = &first;
  const auto version = queue_.empty() ? std::nullopt : runner_.shared_version(first);
  if (!version || first.promised_cost > chunk_) return 1;
  Nanoseconds sum = first.promised_cost;
  ClockTime earliest = latest_end(first);
  const ClockTime now = clock_.now();
  std::size_t count = 1;
  while (count < together.size()) {
    TransactionImpl* const next = queue_.first();
    if (next == nullptr || next->reserved != first.reserved || next->is_to_be_cancelled()) break;
    if (interrupted != nullptr && !ReadyQueue::goes_before(*next, *interrupted)) break;
    sum += next->promised_cost;
    earliest = std::min(earliest, latest_end(*next));
    // Not now + sum: of one without a deadline there is no end.
    if (sum > chunk_ || sum > earliest - now || runner_.shared_version(*next) != version) break;
    together[count++] = queue_.pop();
  }
  return count;
}

void Engine::carry_out_together(std::span<TransactionImpl* const> readers) noexcept {
  std::array<Status, Runner::max_together> statuses{};
  runner_.read_together(readers, statuses, this);
  for (std::size_t k = 0; k < readers.size(); ++k) {
    if (statuses[k] != Status::pending) end(*readers[k], statuses[k]);
  }
  for (std::size_t k = 0; k < readers.size(); ++k) {
    if (statuses[k] != Status::pending) continue;
    if (readers[k]->is_to_be_cancelled()) {
      finish_cancelled(*readers[k], CancelledBy::caller);
    } else {
      carry_out_alone(*readers[k]);
    }
  }
}

}  // namespace rtstdb::transaction
