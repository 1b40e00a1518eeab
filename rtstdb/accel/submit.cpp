#include "rtstdb/accel/submit.hpp"

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

Result<Submit> Submit::create(gpu::Device& device) {
  Submit submit;
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
  recorder_.begin();
  if (!timed_by_host_) recorder_.timestamp(begin_slot);
}

bool Submit::run() {
  if (!timed_by_host_) recorder_.timestamp(end_slot);
  recorder_.end();
  const auto submitted = std::chrono::steady_clock::now();
  const std::uint64_t number = timeline_.submit(recorder_);
  if (number == 0) return false;
  if (meanwhile_ != nullptr) meanwhile_->begin_wait();
  const gpu::WaitResult waited = timeline_.wait(number, std::numeric_limits<std::int64_t>::max());
  const auto finished = std::chrono::steady_clock::now();
  if (meanwhile_ != nullptr) meanwhile_->end_wait();
  if (waited != gpu::WaitResult::done) return false;
  gpu_ns_ += timed_by_host_ ? nanoseconds(finished - submitted)
                            : timeline_.elapsed_ns(recorder_, begin_slot, end_slot);
  return true;
}

}  // namespace rtstdb::accel
