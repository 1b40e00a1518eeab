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

// Words that running shaders read and write.
std::atomic_ref<std::uint32_t> wanted(const gpu::Buffer& halt) noexcept {
  return std::atomic_ref(halt.host_as<shared::HaltWords>()[0].wanted);
}
std::atomic_ref<std::uint32_t> first_unstarted_in(const gpu::Buffer& halt) noexcept {
  return std::atomic_ref(halt.host_as<shared::HaltWords>()[0].first_unstarted);
}

}  // namespace

Result<Submit> Submit::create(gpu::Device& device, std::shared_ptr<DeviceIdle> device_idle) {
  Submit submit;
  submit.device_idle_ = std::move(device_idle);
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

bool Submit::start(const HaltOptions& halt) {
  if (!timed_by_host_) recorder_.timestamp(end_slot);
  recorder_.end();
  halt_options_ = halt;
  halted_early_ = false;
  if (halt_) {
    wanted(halt_).store(0, std::memory_order_relaxed);
    first_unstarted_in(halt_).store(std::numeric_limits<std::uint32_t>::max(), std::memory_order_relaxed);
  }
  started_ = std::chrono::steady_clock::now();
  in_flight_ = timeline_.submit(recorder_);
  lost_ = in_flight_ == 0;
  return !lost_;
}

bool Submit::finish(bool awaited, Submit* next) {
  if (in_flight_ == 0) return !lost_;
  completed_before_wait_ = timed_by_host_ && timeline_.wait(in_flight_, 0) == gpu::WaitResult::done;
  if (callbacks_ != nullptr) callbacks_->begin_wait();
  const gpu::WaitResult waited = wait(awaited, next);
  in_flight_ = 0;
  const auto finished = std::chrono::steady_clock::now();
  if (callbacks_ != nullptr) callbacks_->end_wait();
  lost_ = waited != gpu::WaitResult::done;
  if (lost_) return false;
  gpu_ns_ += timed_by_host_ ? nanoseconds(finished - std::max(started_, *device_idle_))
                            : timeline_.elapsed_ns(recorder_, begin_slot, end_slot);
  *device_idle_ = finished;
  return true;
}

gpu::WaitResult Submit::wait(bool awaited, Submit* next) {
  if (halt_ && halt_options_.halt_after.count() > 0) {
    halted_early_ = awaited && halt_options_.early;
    DeviceIdle check_at = halted_early_ ? std::chrono::steady_clock::now()
                                        : std::max(started_, *device_idle_) + halt_options_.halt_after;
    while (true) {
      const auto left = check_at - std::chrono::steady_clock::now();
      const gpu::WaitResult waited = timeline_.wait(in_flight_, nanoseconds(left));
      if (waited != gpu::WaitResult::timeout) return waited;
      if (awaited || (callbacks_ != nullptr && callbacks_->halt_requested())) break;
      check_at = std::chrono::steady_clock::now() + halt_options_.halt_after / 2;
    }
    halt();
    if (next != nullptr) next->halt();
  }
  return timeline_.wait(in_flight_, std::numeric_limits<std::int64_t>::max());
}

void Submit::halt() noexcept {
  wanted(halt_).store(1, std::memory_order_relaxed);
}

std::uint32_t Submit::first_unstarted() const noexcept {
  return halt_ ? first_unstarted_in(halt_).load(std::memory_order_relaxed)
               : std::numeric_limits<std::uint32_t>::max();
}

}  // namespace rtstdb::accel
