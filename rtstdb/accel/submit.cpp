#include "rtstdb/accel/submit.hpp"

#include <algorithm>
#include <chrono>
#include <limits>

namespace rtstdb::accel {
namespace {

constexpr std::uint32_t begin_slot = 0;
constexpr std::uint32_t end_slot = 1;

std::int64_t nanoseconds(std::chrono::steady_clock::duration duration) noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(duration).count();
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
  return submit;
}

void Submit::begin() {
  lost_ = false;
  recorder_.begin();
  if (!timed_by_host_) recorder_.timestamp(begin_slot);
}

bool Submit::start() {
  if (!timed_by_host_) recorder_.timestamp(end_slot);
  recorder_.end();
  started_ = std::chrono::steady_clock::now();
  under_way_ = timeline_.submit(recorder_);
  lost_ = under_way_ == 0;
  return !lost_;
}

bool Submit::finish() {
  if (under_way_ == 0) return !lost_;
  seen_late_ = timed_by_host_ && timeline_.wait(under_way_, 0) == gpu::WaitResult::done;
  if (meanwhile_ != nullptr) meanwhile_->begin_wait();
  const gpu::WaitResult waited =
      timeline_.wait(std::exchange(under_way_, 0), std::numeric_limits<std::int64_t>::max());
  const auto finished = std::chrono::steady_clock::now();
  if (meanwhile_ != nullptr) meanwhile_->end_wait();
  lost_ = waited != gpu::WaitResult::done;
  if (lost_) return false;
  gpu_ns_ += timed_by_host_ ? nanoseconds(finished - std::max(started_, *device_free_))
                            : timeline_.elapsed_ns(recorder_, begin_slot, end_slot);
  *device_free_ = finished;
  return true;
}

}  // namespace rtstdb::accel
