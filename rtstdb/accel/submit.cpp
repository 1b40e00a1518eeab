#include "rtstdb/accel/submit.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <limits>

#include "shaders/shared/halt.h"

namespace rtstdb::accel {
namespace {

constexpr std::uint32_t begin_slot = 0;
constexpr std::uint32_t end_slot = 1;

std::int64_t nanoseconds(std::chrono::steady_clock::duration duration) noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
}

// What shaders read and write meanwhile.
std::atomic_ref<std::uint32_t> wanted(const gpu::Buffer& halt) noexcept {
  return std::atomic_ref(halt.host_as<shared::HaltWords>()[0].wanted);
}
std::atomic_ref<std::uint32_t> first_left_in(const gpu::Buffer& halt) noexcept {
  return std::atomic_ref(halt.host_as<shared::HaltWords>()[0].first_unstarted);
}

}  // namespace

Result<Submit> Submit::create(gpu::Device& device, std::shared_ptr<DeviceFree> device_free) {
  Submit submit;
  submit.device_free_ = std::move(device_free);
  auto recorder = device.create_recorder();
  if (!recorder) return recorder.error();
  submit.recorder_ = std::move(recorder).value();
  auto timeline = device.create_timeline();
  if (!timeline) return timeline.error();
  submit.timeline_ = std::move(timeline).value();
  submit.timed_by_host_ = device.info().software;
  if (!device.info().software) return submit;
  auto halt = device.create_buffer({.name = "halt",
                                    .size_bytes = sizeof(shared::HaltWords),
                                    .memory = gpu::Memory::readback,
                                    .addressed = true});
  if (!halt) return halt.error();
  submit.halt_ = std::move(halt).value();
  return submit;
}

void Submit::begin() {
  lost_ = false;
  recorder_.begin();
  if (!timed_by_host_) recorder_.timestamp(begin_slot);
}

bool Submit::start(const Halting& halting) {
  if (!timed_by_host_) recorder_.timestamp(end_slot);
  recorder_.end();
  halting_ = halting;
  halted_at_once_ = false;
  if (halt_) {
    wanted(halt_).store(0, std::memory_order_relaxed);
    first_left_in(halt_).store(std::numeric_limits<std::uint32_t>::max(), std::memory_order_relaxed);
  }
  started_ = std::chrono::steady_clock::now();
  under_way_ = timeline_.submit(recorder_);
  lost_ = under_way_ == 0;
  return !lost_;
}

bool Submit::finish(bool awaited, Submit* behind) {
  if (under_way_ == 0) return !lost_;
  seen_late_ = timed_by_host_ && timeline_.wait(under_way_, 0) == gpu::WaitResult::done;
  if (callbacks_ != nullptr) callbacks_->begin_wait();
  const gpu::WaitResult waited = wait(awaited, behind);
  under_way_ = 0;
  const auto finished = std::chrono::steady_clock::now();
  if (callbacks_ != nullptr) callbacks_->end_wait();
  lost_ = waited != gpu::WaitResult::done;
  if (lost_) return false;
  gpu_ns_ += timed_by_host_ ? nanoseconds(finished - std::max(started_, *device_free_))
                            : timeline_.elapsed_ns(recorder_, begin_slot, end_slot);
  *device_free_ = finished;
  return true;
}

gpu::WaitResult Submit::wait(bool awaited, Submit* behind) {
  if (halt_ && halting_.halt_after.count() > 0) {
    halted_at_once_ = awaited && halting_.at_once;
    DeviceFree look = halted_at_once_ ? std::chrono::steady_clock::now()
                                      : std::max(started_, *device_free_) + halting_.halt_after;
    while (true) {
      const auto left = look - std::chrono::steady_clock::now();
      const gpu::WaitResult waited = timeline_.wait(under_way_, nanoseconds(left));
      if (waited != gpu::WaitResult::timeout) return waited;
      if (awaited || (callbacks_ != nullptr && callbacks_->preemption_requested())) break;
      look = std::chrono::steady_clock::now() + halting_.halt_after / 2;
    }
    halt();
    if (behind != nullptr) behind->halt();
  }
  return timeline_.wait(under_way_, std::numeric_limits<std::int64_t>::max());
}

void Submit::halt() noexcept {
  wanted(halt_).store(1, std::memory_order_relaxed);
}

std::uint32_t Submit::first_unstarted() const noexcept {
  return halt_ ? first_left_in(halt_).load(std::memory_order_relaxed)
               : std::numeric_limits<std::uint32_t>::max();
}

}  // namespace rtstdb::accel
