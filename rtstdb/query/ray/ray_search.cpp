#include "rtstdb/query/ray/ray_search.hpp"

#include <algorithm>
#include <utility>

#include "rtstdb/query/ray/ray_coherence.hpp"

namespace rtstdb::query {
namespace {

/// Worlds with this many entities gain by work sharing (shaders/query/simd8/work_sharing.glsl).
constexpr std::uint32_t min_entities_for_work_sharing = 16;

/// After this many passes that lost their slot to other runs, searches are left incomplete.
constexpr std::uint32_t max_restarts = 16;

/// Words that the kernels write once for all rays of a batch (IncompleteBuffer in
/// shaders/query/ray/ray_buffers.glsl).
enum Flag : std::uint8_t { flag_incomplete, flag_unanswered, flag_paused };

std::uint32_t low_word(WorldTime t) noexcept {
  return static_cast<std::uint32_t>(t.time_since_epoch().count());
}

/// Of a paused search (shaders/query/ray/pause.glsl).
constexpr std::size_t words_of_paused_search(RayMode mode, std::uint32_t hits_per_ray) noexcept {
  const std::uint32_t hits = mode != RayMode::first ? 0 : hits_per_ray <= 4 ? 4 : 16;
  return shared::paused_ray_words + hits * shared::paused_hit_words;
}

/// In the order that RaySearch::kernel_for expects: for rays at one instant, for moving rays; then the same
/// two as packets and with work sharing, on devices whose subgroups have eight lanes. A list of hits has one
/// kernel for all rays.
std::vector<gpu::ShaderId> ray_shaders(RayMode mode, std::uint32_t hits_per_ray, bool eight_lanes) {
  using enum gpu::ShaderId;
  std::vector<gpu::ShaderId> shaders;
  switch (mode) {
    case RayMode::any:
      shaders = {ray_any,
                 ray_any_moving,
                 ray_any_packet,
                 ray_any_packet_moving,
                 ray_any_work_sharing,
                 ray_any_work_sharing_moving};
      break;
    case RayMode::first:
      return {hits_per_ray <= 4 ? ray_first_4 : ray_first_16};
    case RayMode::closest:
      shaders = {ray_closest,
                 ray_closest_moving,
                 ray_closest_packet,
                 ray_closest_packet_moving,
                 ray_closest_work_sharing,
                 ray_closest_work_sharing_moving};
      break;
  }
  if (!eight_lanes) shaders.resize(2);
  return shaders;
}

}  // namespace

void RaySearch::add_needs(DeviceNeeds& needs, const std::string& name, const gpu::DeviceLimits& limits) {
  first_kernel_ = needs.kernels.size();
  for (const gpu::ShaderId shader :
       ray_shaders(mode_, hits_per_ray_, limits.subgroup_size == rays_per_packet))
    needs.kernels.push_back(kernel_need(shader, shared::RayArgs{}));
  kernel_count_ = needs.kernels.size() - first_kernel_;
  const std::size_t retried = std::min(capacity_, shared::paused_rays);
  const auto texels = [&](const char* what, std::size_t size_bytes, gpu::Memory memory) {
    return gpu::BufferOptions{
        .name = name + what, .size_bytes = size_bytes, .memory = memory, .texel_uint4 = true};
  };
  needs.buffers.push_back(
      {&retried_rays_, texels(" retried rays", (4 * retried + 15) / 16 * 16, gpu::Memory::upload)});
  needs.buffers.push_back({&flags_, texels(" flags", 16, gpu::Memory::readback)});
  needs.buffers.push_back({&paused_,
                           {.name = name + " paused searches",
                            .size_bytes = 4 * retried * words_of_paused_search(mode_, hits_per_ray_)}});
}

std::vector<const gpu::Buffer*> RaySearch::bound_buffers(const gpu::Buffer& rays, std::uint32_t slot,
                                                         const accel::GeometryPool& pool,
                                                         const accel::Tlas& tlas) const {
  return {&pool.nodes(),
          &pool.triangles(),
          &tlas.nodes(slot),
          &tlas.instances(slot),
          &tlas.identity_texels(slot),
          &rays,
          &flags_,
          &tlas.places(slot),
          &retried_rays_,
          &paused_};
}

void RaySearch::begin() noexcept {
  std::ranges::fill(flags_.host_as<std::uint32_t>(), 0u);
  restarts_ = 0;
  some_restart_ = false;
}

bool RaySearch::has_paused() noexcept {
  std::uint32_t& paused = flags_.host_as<std::uint32_t>()[flag_paused];
  restarts_ += std::exchange(some_restart_, false) ? 1 : 0;
  if (std::exchange(paused, 0u) != 0 && restarts_ <= max_restarts) return true;
  restarts_ = 0;
  return false;
}

std::uint32_t RaySearch::min_retry_batch(const gpu::DeviceLimits& limits) const noexcept {
  return limits.processors == 0 ? shared::paused_rays : rays_per_packet * limits.processors;
}

std::size_t RaySearch::kernel_for(const RayPass& pass, const accel::TlasView& view) const noexcept {
  const bool moving = pass.carried || view.window_end > view.window_begin;
  const std::size_t first = pass.coherent ? 2 : view.entities >= min_entities_for_work_sharing ? 4 : 0;
  // Where the device has fewer kernels, the one that gives the same answers.
  return first_kernel_ + ((moving ? 1 : 0) + first) % kernel_count_;
}

void RaySearch::pack_retries(PlaceRange range, std::span<const std::uint32_t> retried,
                             const accel::TlasView& view) noexcept {
  const auto words = retried_rays_.host_as<std::uint32_t>();
  for (std::uint32_t i = range.first; i < range.end; ++i) {
    const std::uint64_t before = std::exchange(searched_contents_[i], view.contents);
    words[i] = retried[i] | (before != view.contents ? shared::ray_begins_bit : 0u);
    some_restart_ = some_restart_ || (before != 0 && before != view.contents);
  }
}

RaySearch::Dispatch RaySearch::dispatch(const BatchPart& part, std::span<const std::uint32_t> retried,
                                        const RayPass& pass, const Recording& recording,
                                        const gpu::DeviceLimits& limits) noexcept {
  const PlaceRange range = part.range;
  const accel::TlasView& view = recording.view;
  if (part.is_retry) pack_retries(range, retried, view);
  const double window_s = seconds_between(view.window_begin, view.window_end);
  // Paused searches are not halted: they pause.
  const HaltAt halt = part.is_retry ? HaltAt{} : recording.halt;
  const DispatchLayout layout = spread_out(range.end - range.first, limits.processors);
  // The second kernel's searches pause and go on in a later dispatch.
  const std::size_t kernel = part.is_retry ? first_kernel_ + 1 % kernel_count_ : kernel_for(pass, view);
  return {kernel, layout,
          shared::RayArgs{.root = view.root,
                          .first = range.first,
                          .end = range.end,
                          .per_group = layout.per_group,
                          .is_retry = part.is_retry ? 1u : 0u,
                          .epoch_ns = low_word(view.epoch),
                          .late_base = view.late_base,
                          .still = pass.ignore_motion ? 1u : 0u,
                          .still_ns = low_word(recording.rows.time()),
                          .window_begin_ns = low_word(view.window_begin),
                          .per_window_ns = window_s > 0.0 ? static_cast<float>(1e-9 / window_s) : 0.0f,
                          .hits_per_ray = hits_per_ray_,
                          .hits = pass.hits,
                          .faces = pass.faces == Faces::both    ? 0.0f
                                   : pass.faces == Faces::front ? 1.0f
                                                                : -1.0f,
                          .halt = halt.words,
                          .halt_from = halt.from,
                          .loop_probe = 2 /* two rounds, see loops_still_turn */}};
}

bool RaySearch::some_incomplete() const noexcept {
  return flags_.host_as<const std::uint32_t>()[flag_incomplete] != 0;
}

bool RaySearch::some_unanswered() const noexcept {
  return flags_.host_as<const std::uint32_t>()[flag_unanswered] != 0;
}

}  // namespace rtstdb::query
