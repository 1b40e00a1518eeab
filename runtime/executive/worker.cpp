#include "runtime/executive/worker.hpp"

#include <pthread.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "runtime/executive/misuse.hpp"

namespace hil::executive {
namespace {

void wait_for(sem_t& semaphore) noexcept {
  while (sem_wait(&semaphore) != 0 && errno == EINTR) {
  }
}

}  // namespace

void record_usage(RunRecord& record, const ThreadUsage& before, const ThreadUsage& after) noexcept {
  record.cpu_ns = after.cpu_ns - before.cpu_ns;
  record.minor_faults = after.faults.minor - before.faults.minor;
  record.major_faults = after.faults.major - before.faults.major;
}

void spend(std::int64_t added_ns, const Clock& clock) noexcept {
  const std::int64_t until_ns = clock.now_ns() + added_ns;
  while (clock.now_ns() < until_ns) {
  }
}

void run_step(TaskSlot& slot, const Clock& clock, const Probe& probe) noexcept {
  RunRecord& record = slot.record;
  const ThreadUsage before = read_thread_usage(probe);
  record.start_ns = clock.now_ns();
  slot.task.step(slot.info);
  const std::int64_t added_ns = slot.task.added_ns();
  if (added_ns > 0 && !clock.is_virtual()) spend(added_ns, clock);
  record.finish_ns = clock.now_ns();
  record_usage(record, before, read_thread_usage(probe));
  if (clock.is_virtual()) {  // the base thread does not wait for it
    record.finish_ns += added_ns;
    record.cpu_ns += added_ns;
  }
  record.blocked_ns = slot.task.last_blocked_ns();
  record.gpu_ns = slot.task.last_gpu_ns();
}

Worker::Worker(std::string name, const Clock& clock, const Probe& probe, std::size_t ring_capacity)
    : records_(ring_capacity), name_(std::move(name)), clock_(clock), probe_(probe) {
  sem_init(&wake_, 0, 0);
  sem_init(&ready_, 0, 0);
}

Worker::~Worker() {
  stop();
  sem_destroy(&wake_);
  sem_destroy(&ready_);
}

void Worker::add(TaskSlot& slot) {
  slots_.push_back(&slot);
  std::stable_sort(slots_.begin(), slots_.end(), [](const TaskSlot* left, const TaskSlot* right) {
    return left->period_ns < right->period_ns;
  });
}

std::int64_t Worker::shortest_period_ns() const noexcept {
  return slots_.front()->period_ns;
}

std::vector<std::string> Worker::start(const RealtimeOptions& options, int priority) {
  require(!thread_.joinable(), "a task's thread is started once");
  thread_ = std::thread([this, &options, priority] { serve(options, priority); });
  wait_for(ready_);
  return refused_;
}

void Worker::wake() noexcept {
  sem_post(&wake_);
}

void Worker::stop() {
  if (!thread_.joinable()) return;
  stopping_.store(true, std::memory_order_release);
  sem_post(&wake_);
  thread_.join();
}

void Worker::serve(const RealtimeOptions& options, int priority) {
  pthread_setname_np(pthread_self(), name_.substr(0, 15).c_str());
  const ThreadRealtime realtime(options, priority);
  refused_ = realtime.refused();
  sem_post(&ready_);
  // `options` is not used from here on.
  while (true) {
    wait_for(wake_);
    const bool last_round = stopping_.load(std::memory_order_acquire);
    while (TaskSlot* slot = take_released())
      run(*slot);
    if (last_round) return;
  }
}

TaskSlot* Worker::take_released() noexcept {
  for (TaskSlot* slot : slots_) {
    Phase expected = Phase::released;
    if (slot->phase.compare_exchange_strong(expected, Phase::running, std::memory_order_acq_rel)) return slot;
  }
  return nullptr;
}

void Worker::run(TaskSlot& slot) noexcept {
  slot.record.thread_free_ns = free_ns_;
  run_step(slot, clock_, probe_);
  free_ns_ = slot.record.finish_ns;
  records_.push(slot.record);
  slot.phase.store(Phase::finished, std::memory_order_release);
}

}  // namespace hil::executive
