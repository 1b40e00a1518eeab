#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "rtstdb/gpu/recorder_impl.hpp"
#include "rtstdb/gpu/timestamp.hpp"

namespace rtstdb::gpu {
namespace {

vk::raii::Semaphore create_semaphore(const vk::raii::Device& device) {
  const vk::SemaphoreTypeCreateInfo timeline(vk::SemaphoreType::eTimeline, 0);
  vk::SemaphoreCreateInfo options;
  options.pNext = &timeline;
  return {device, options};
}

}  // namespace

Timeline::Impl::Impl(std::shared_ptr<Device::Impl> device_in)
    : device(std::move(device_in)), semaphore(create_semaphore(device->device)) {}

Timeline::Impl::~Impl() {
  wait(last_number, std::numeric_limits<std::uint64_t>::max());
}

WaitResult Timeline::Impl::wait(std::uint64_t number, std::uint64_t timeout_ns) const noexcept {
  if (device->lost) return WaitResult::lost;
  const VkSemaphore handle = *semaphore;
  const VkSemaphoreWaitInfo info{VK_STRUCTURE_TYPE_SEMAPHORE_WAIT_INFO, nullptr, 0, 1, &handle, &number};
  const VkResult result = device->vk().vkWaitSemaphores(*device->device, &info, timeout_ns);
  if (result == VK_SUCCESS) return WaitResult::done;
  if (result == VK_TIMEOUT) return WaitResult::timeout;
  device->lost = true;
  return WaitResult::lost;
}

Result<Timeline> Device::create_timeline() {
  return impl_->attempt("a timeline can not be created", [&]() -> Result<Timeline> {
    Timeline timeline;
    timeline.impl_ = std::make_shared<Timeline::Impl>(impl_);
    return timeline;
  });
}

Timeline::Timeline() = default;
Timeline::~Timeline() = default;
Timeline::Timeline(Timeline&&) noexcept = default;
Timeline& Timeline::operator=(Timeline&&) noexcept = default;

std::uint64_t Timeline::submit(Recorder& recorder) {
  RTSTDB_ASSERT(impl_ != nullptr && recorder.impl_ != nullptr, "the timeline or the recorder was moved from");
  Recorder::Impl& recorded = *recorder.impl_;
  Device::Impl& device = *impl_->device;
  RTSTDB_ASSERT(recorded.device == impl_->device, "the recorder is of another device");
  RTSTDB_ASSERT(recorded.state == Recorder::Impl::State::recorded, "the recorder has no complete recording");
  RTSTDB_ASSERT(recorded.finished(), "the last submission of the recorder has not finished");
  if (device.lost) return 0;
  device.vk().vkResetQueryPool(*device.device, *recorded.timestamps, 0, Recorder::max_timestamps);

  const std::uint64_t number = impl_->last_number + 1;
  const vk::CommandBufferSubmitInfo commands(*recorded.commands);
  const vk::SemaphoreSubmitInfo signal(*impl_->semaphore, number, vk::PipelineStageFlagBits2::eAllCommands);
  const vk::SubmitInfo2 submission({}, {}, commands, signal);
  const VkSubmitInfo2& raw = submission;
  const std::lock_guard lock(device.queue_mutex);
  if (device.vk().vkQueueSubmit2(*device.queue, 1, &raw, VK_NULL_HANDLE) != VK_SUCCESS) {
    device.lost = true;
    return 0;
  }
  impl_->last_number = number;
  recorded.submitted_to = impl_;
  recorded.number = number;
  return number;
}

WaitResult Timeline::wait(std::uint64_t number, std::int64_t timeout_ns) {
  RTSTDB_ASSERT(impl_ != nullptr && number <= impl_->last_number,
                "the timeline was moved from, or the number was never submitted");
  return impl_->wait(number, static_cast<std::uint64_t>(std::max<std::int64_t>(timeout_ns, 0)));
}

std::int64_t Timeline::elapsed_ns(const Recorder& recorder, std::uint32_t from_slot,
                                  std::uint32_t to_slot) const {
  RTSTDB_ASSERT(impl_ != nullptr && recorder.impl_ != nullptr, "the timeline or the recorder was moved from");
  const Recorder::Impl& recorded = *recorder.impl_;
  const Device::Impl& device = *impl_->device;
  RTSTDB_ASSERT(recorded.submitted_to == impl_ && recorded.finished(),
                "the recorder was not submitted to this timeline, or has not finished");
  RTSTDB_ASSERT(from_slot < Recorder::max_timestamps && to_slot < Recorder::max_timestamps,
                "a slot is not below max_timestamps");
  RTSTDB_ASSERT(
      (recorded.written_slots >> from_slot & 1u) != 0 && (recorded.written_slots >> to_slot & 1u) != 0,
      "a slot has no timestamp");
  const auto read = [&](std::uint32_t slot, std::uint64_t& value) {
    return device.vk().vkGetQueryPoolResults(*device.device, *recorded.timestamps, slot, 1, sizeof(value),
                                             &value, sizeof(value), VK_QUERY_RESULT_64_BIT) == VK_SUCCESS;
  };
  std::uint64_t from = 0;
  std::uint64_t to = 0;
  if (device.lost || !read(from_slot, from) || !read(to_slot, to)) {
    impl_->device->lost = true;
    return 0;
  }
  const std::int64_t ticks = timestamp_difference(from, to, device.timestamp_bits);
  return std::llround(static_cast<double>(ticks) * device.timestamp_period_ns);
}

}  // namespace rtstdb::gpu
