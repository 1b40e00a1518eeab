#include "rtstdb/transaction/write_helper.hpp"

namespace rtstdb::transaction {

void WriteHelper::start() {
  thread_ = std::thread([this] { run_thread(); });
}

void WriteHelper::stop() noexcept {
  stopping_.store(true, std::memory_order_release);
  wake_up_.notify();
  if (thread_.joinable()) thread_.join();
}

void WriteHelper::end_wait() noexcept {
  device_is_done_.store(true, std::memory_order_relaxed);
  lock_.lock();
  device_is_done_.store(false, std::memory_order_relaxed);
  in_wait_.store(false, std::memory_order_relaxed);
}

void WriteHelper::run_thread() noexcept {
  while (!stopping_.load(std::memory_order_acquire)) {
    const std::uint32_t seen = wake_up_.count();
    if (in_wait_.load(std::memory_order_seq_cst)) {
      const std::lock_guard guard(lock_);
      if (in_wait_.load(std::memory_order_relaxed)) work_.work_in_wait();
    }
    wake_up_.wait(seen);
  }
}

}  // namespace rtstdb::transaction
