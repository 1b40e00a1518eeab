// What the engine does when there is no device: what was on it has been given back as lost by then. While another one
// takes its place, the relief goes on with what only writes, and what waits for queries goes on waiting unless its
// deadline is firm and too soon. Where the device does not come back, what asks is lost at once, and writes go on.

#include "rtstdb/transaction/engine.hpp"

namespace rtstdb::transaction {

void Engine::revive_device() noexcept {
  if (!clock_.is_virtual()) device_back_at_ = clock_.now() + executor_.revival_takes();
  executor_.revive(this);
  device_back_at_.reset();
}

void Engine::fail_unmeetable() noexcept {
  if (!device_back_at_) return;
  const auto hopeless = [this](const TransactionImpl& waiting) {
    return !waiting.requests().empty() && waiting.is(DeadlineClass::firm) &&
           waiting.terms().deadline < *device_back_at_;
  };
  while (TransactionImpl* const waiting = queue_.pop_first(hopeless))
    finish(*waiting, Status::device_lost);
}

}  // namespace rtstdb::transaction
