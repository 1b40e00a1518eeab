#include "rtstdb/query/gpu_query.hpp"

#include <algorithm>
#include <utility>

namespace rtstdb::query {

Result<void> GpuQuery::move_to(gpu::Device& device) {
  leave_device();
  limits_ = device.limits();
  DeviceNeeds needs = device_needs(limits_);
  for (KernelNeed& need : needs.kernels) {
    auto pipeline = device.create_pipeline(need.shader);
    if (!pipeline) return pipeline.error();
    kernels_.push_back({.shader = need.shader,
                        .idle_arguments = std::move(need.idle_arguments),
                        .pipeline = std::move(pipeline).value(),
                        .bindings = {}});
  }
  for (const gpu::BufferRequest& wanted : needs.buffers)
    buffers_.push_back(wanted.buffer);
  if (auto made = device.create_buffers(needs.buffers); !made) return made;
  initialize_buffers();
  incomplete_.reserve(max_places_);
  return create_more(device);
}

void GpuQuery::leave_device() noexcept {
  destroy_more();
  kernels_.clear();
  for (gpu::Buffer* buffer : buffers_)
    *buffer = {};
  buffers_.clear();
}

Result<void> GpuQuery::bind(gpu::Device& device, const accel::GeometryPool& pool, const accel::Tlas& tlas) {
  for (Kernel& kernel : kernels_) {
    kernel.bindings.clear();
    const std::size_t used = gpu::shader_info(kernel.shader).bindings.size();
    for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
      const auto buffers = bound_buffers(kernel.shader, slot, pool, tlas);
      auto bindings = device.create_bindings(kernel.pipeline, std::span(buffers).first(used));
      if (!bindings) return bindings.error();
      kernel.bindings.push_back(std::move(bindings).value());
    }
  }
  return bind_more(device, pool, tlas);
}

void GpuQuery::record_warm_up(gpu::Recorder& recorder) noexcept {
  for (const Kernel& kernel : kernels_)
    recorder.dispatch(kernel.pipeline, kernel.bindings.front(), std::span(kernel.idle_arguments), 1);
  record_more_warm_up(recorder);
}

void GpuQuery::begin_batch(std::uint32_t count, const BatchWorld& world) noexcept {
  count_ = count;
  stage_ = answered_ = 0;
  some_overflow_ = false;
  incomplete_.clear();
  settled_ = window_ = retried_ = 0;
  places_ = begin_first_stage(count, world);
}

bool GpuQuery::begin_next_stage(const BatchWorld& world) noexcept {
  while (!is_last_stage()) {
    ++stage_;
    incomplete_.clear();
    settled_ = window_ = retried_ = 0;
    places_ = begin_stage(stage_, world);
    if (places_ > 0) return true;
    answered_ = answered_after(stage_, count_);
  }
  places_ = 0;
  return false;
}

std::uint32_t GpuQuery::next_retry_batch() noexcept {
  return advance_retries(std::numeric_limits<std::uint32_t>::max());
}

std::uint32_t GpuQuery::advance_retries(std::uint32_t limit) noexcept {
  settled_ += window_;
  window_ = std::min(static_cast<std::uint32_t>(incomplete_.size()) - settled_, limit);
  retried_ = 0;
  return window_;
}

void GpuQuery::take_answers(const BatchPart& part, const accel::TlasView& view) noexcept {
  if (part.is_retry) {
    unpack(part, view);
    retried_ = part.range.end;
    return;
  }
  if (stages() == 1)
    answered_ = part.range.end;
  else if (part.range.end == places_)
    answered_ = answered_after(stage_, count_);
  unpack(part, view);
}

std::uint32_t GpuQuery::incomplete(std::uint32_t answered) const noexcept {
  return static_cast<std::uint32_t>(std::ranges::count_if(
      incomplete_, [&](std::uint32_t place) { return place < answered && is_incomplete(place); }));
}

bool GpuQuery::has_retries() const noexcept {
  const std::uint32_t ended = retries_pause_ ? 0 : retried_;
  return std::ranges::any_of(std::span(incomplete_).subspan(settled_ + ended),
                             [&](std::uint32_t place) { return is_incomplete(place); });
}

void GpuQuery::publish_answers(std::uint32_t answered, std::uint32_t count) noexcept {
  for (std::uint32_t place = answered; place < count; ++place)
    mark_incomplete(place);
  slots_.publish(count);
}

}  // namespace rtstdb::query
