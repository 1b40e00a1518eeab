#include "rtstdb/transaction/device_revival.hpp"

namespace rtstdb::transaction {

void DeviceRevival::revive(query::ExecutorCallbacks& callbacks) noexcept {
  if (!clock_.is_virtual()) expected_back_ = clock_.now() + executor_.revival_takes();
  executor_.revive(&callbacks);
  expected_back_.reset();
}

scheduler::ScheduledTransaction* DeviceRevival::pop_unmeetable() noexcept {
  if (!expected_back_) return nullptr;
  return queue_.pop_first([this](const scheduler::ScheduledTransaction& waiting) {
    return waiting.has_queries() && waiting.is(DeadlineClass::firm) &&
           waiting.terms().deadline < *expected_back_;
  });
}

}  // namespace rtstdb::transaction
