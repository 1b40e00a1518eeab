#include "rtstdb/query/ray/ray_query.hpp"

#include <algorithm>
#include <cstddef>
#include <memory>
#include <utility>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/make_query.hpp"
#include "rtstdb/query/ray/ray_check.hpp"
#include "rtstdb/query/ray/ray_coherence.hpp"

namespace rtstdb::query {
namespace {

/// How many rays ahead check prefetches.
constexpr std::uint32_t prefetch_distance = 64;

/// Worlds with this many entities gain by work sharing (shaders/query/simd8/work_sharing.glsl).
constexpr std::uint32_t min_entities_for_work_sharing = 16;

/// After this many passes that lost their slot to other runs, searches are left incomplete.
constexpr std::uint32_t max_restarts = 16;

// shaders/shared/query.h describes rays as texels and hits as pairs of words.
static_assert(sizeof(Ray) == 16 * shared::ray_texels && offsetof(Ray, direction) == 12 &&
              offsetof(Ray, lambda_min) == 24 && offsetof(Ray, t) == 32 && offsetof(Ray, mask) == 40 &&
              offsetof(Ray, carrier) == 44);
static_assert(sizeof(RayHit) == 8 * shared::hit_pairs && offsetof(RayHit, entity) == 16 &&
              offsetof(RayHit, mask) == 24 && offsetof(RayHit, triangle) == 32 &&
              offsetof(RayHit, front_face) == 36 && sizeof(bool) == 1 && offsetof(RayHit, n_world) == 40 &&
              offsetof(RayHit, v_relative_mps) == 52);

/// Words that the kernels write once for all rays of a batch (IncompleteBuffer in
/// shaders/query/ray/ray_buffers.glsl).
enum Flag : std::uint8_t { some_incomplete, some_unanswered, some_paused };

std::uint32_t low_word(WorldTime t) noexcept {
  return static_cast<std::uint32_t>(t.time_since_epoch().count());
}

/// Of a paused search (shaders/query/ray/pause.glsl).
constexpr std::size_t words_of_paused_search(const RayQueryOptions& options) noexcept {
  const std::uint32_t hits = options.mode != RayMode::first ? 0 : options.hits_per_ray <= 4 ? 4 : 16;
  return shared::paused_ray_words + hits * shared::paused_hit_words;
}

/// In the order that GpuRayQuery::kernel_for expects: for rays at one instant, for moving rays; then the same
/// two as packets and with work sharing, on devices whose subgroups have eight lanes. A list of hits has one
/// kernel for all rays.
std::vector<gpu::ShaderId> ray_shaders(const RayQueryOptions& options, bool eight_lanes) {
  using enum gpu::ShaderId;
  std::vector<gpu::ShaderId> shaders;
  switch (options.mode) {
    case RayMode::any:
      shaders = {ray_any,
                 ray_any_moving,
                 ray_any_packet,
                 ray_any_packet_moving,
                 ray_any_work_sharing,
                 ray_any_work_sharing_moving};
      break;
    case RayMode::first:
      return {options.hits_per_ray <= 4 ? ray_first_4 : ray_first_16};
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

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const RayQueryOptions& options) {
  if (auto checked = check_ray_options(options); !checked) return checked.error();
  return on_device(std::make_unique<GpuRayQuery>(options), device);
}

GpuRayQuery::GpuRayQuery(const RayQueryOptions& options)
    : GpuQuery(options.capacity, options.late), options_(options) {
  let_retries_pause();
  ray_memory_ = gpu::HostMemory(options.capacity * sizeof(Ray));
  std::uninitialized_default_construct_n(ray_memory_.as<Ray>().data(), options.capacity);
  const std::size_t hits = std::size_t{options.capacity} * options.hits_per_ray;
  for (std::size_t slot = 0; slot < slots().count(); ++slot) {
    hit_memory_.emplace_back(hits * sizeof(RayHit));
    std::uninitialized_default_construct_n(hit_memory_.back().as<RayHit>().data(), hits);
  }
  hits_.resize(slots().count());
}

CostClass GpuRayQuery::cost_class() const noexcept {
  switch (options_.mode) {
    case RayMode::any:
      return CostClass::ray_any;
    case RayMode::first:
      return CostClass::ray_first;
    case RayMode::closest:
      break;
  }
  return CostClass::ray_closest;
}

DeviceNeeds GpuRayQuery::device_needs(const gpu::DeviceLimits& limits) {
  DeviceNeeds needs;
  for (const gpu::ShaderId shader : ray_shaders(options_, limits.subgroup_size == rays_per_packet))
    needs.kernels.push_back(kernel_need(shader, shared::RayArgs{}));
  const std::size_t retried = std::min(options_.capacity, shared::paused_rays);
  const auto texels = [&](const char* what, std::size_t size_bytes, gpu::Memory memory) {
    return gpu::BufferOptions{
        .name = options_.name + what, .size_bytes = size_bytes, .memory = memory, .texel_uint4 = true};
  };
  auto rays = texels(" rays", ray_memory_.size_bytes(), gpu::Memory::upload);
  rays.texel_float4 = true;
  rays.host = &ray_memory_;
  needs.buffers = {
      {&rays_, rays},
      {&retried_rays_, texels(" retried rays", (4 * retried + 15) / 16 * 16, gpu::Memory::upload)},
      {&flags_, texels(" flags", 16, gpu::Memory::readback)},
      {&paused_,
       {.name = options_.name + " paused searches",
        .size_bytes = 4 * retried * words_of_paused_search(options_)}}};
  for (std::size_t slot = 0; slot < hits_.size(); ++slot) {
    needs.buffers.push_back({&hits_[slot],
                             {.name = options_.name + " hits",
                              .size_bytes = hit_memory_[slot].size_bytes(),
                              .memory = gpu::Memory::readback,
                              .addressed = true,
                              .host = &hit_memory_[slot]}});
  }
  return needs;
}

void GpuRayQuery::initialize_buffers() noexcept {
  // Not every kernel writes all of a hit.
  for (const gpu::Buffer& hits : hits_)
    hits.flush(0, hits.size_bytes());
}

std::vector<const gpu::Buffer*> GpuRayQuery::bound_buffers(gpu::ShaderId /*shader*/, std::uint32_t slot,
                                                           const accel::GeometryPool& pool,
                                                           const accel::Tlas& tlas) const {
  return {&pool.nodes(),
          &pool.triangles(),
          &tlas.nodes(slot),
          &tlas.instances(slot),
          &tlas.identity_texels(slot),
          &rays_,
          &flags_,
          &tlas.places(slot),
          &retried_rays_,
          &paused_};
}

// ---- check

std::optional<BadInput> GpuRayQuery::check(std::uint32_t count, const RowSource& rows,
                                           TimeSpan& times) const noexcept {
  const auto rays = ray_memory_.as<const Ray>().first(count);
  // With ignore_motion every ray has the version's own time.
  const WorldTime earliest = options_.ignore_motion ? WorldTime::min() : rows.time();
  const WorldTime latest = options_.ignore_motion ? WorldTime::max() : world_time_ns(max_world_time_ns);
  carried_ = false;
  TimeSpan span;
  EntityId known_carrier;  // most batches have one
  for (std::uint32_t i = 0; i < count; ++i) {
    const Ray& ray = rays[i];
    __builtin_prefetch(&rays[std::min(i + prefetch_distance, count - 1)]);
    span.first = std::min(span.first, ray.t);
    span.last = std::max(span.last, ray.t);
    const bool known = ray.carrier == known_carrier;
    if (is_valid_ray(ray) & (ray.t >= earliest) & (ray.t <= latest) & known) [[likely]]
      continue;
    if (const auto bad = check_ray(ray, i, options_.ignore_motion, rows)) return bad;
    known_carrier = ray.carrier;
    carried_ = carried_ || ray.carrier.valid();
  }
  if (count > 0) {
    times.first = std::min(times.first, options_.ignore_motion ? rows.time() : span.first);
    times.last = std::max(times.last, options_.ignore_motion ? rows.time() : span.last);
  }
  coherent_ = are_coherent(rays);
  return std::nullopt;
}

// ---- a run

void GpuRayQuery::order_batch(std::uint32_t /*count*/) noexcept {
  std::ranges::fill(flags_.host_as<std::uint32_t>(), 0u);
  restarts_ = 0;
  some_restart_ = false;
}

std::uint32_t GpuRayQuery::next_retry_batch() noexcept {
  std::uint32_t& paused = flags_.host_as<std::uint32_t>()[some_paused];
  restarts_ += std::exchange(some_restart_, false) ? 1 : 0;
  if (std::exchange(paused, 0u) != 0 && restarts_ <= max_restarts)
    return static_cast<std::uint32_t>(retry_places().size());
  searched_contents_.fill(0);
  restarts_ = 0;
  return advance_retries(shared::paused_rays);
}

std::uint32_t GpuRayQuery::min_retry_batch() const noexcept {
  return limits().processors == 0 ? shared::paused_rays : rays_per_packet * limits().processors;
}

const Kernel& GpuRayQuery::kernel_for(bool moving, std::uint32_t entities) const noexcept {
  const std::size_t first = coherent_ ? 2 : entities >= min_entities_for_work_sharing ? 4 : 0;
  return kernel(((moving ? 1 : 0) + first) % kernel_count());
}

void GpuRayQuery::pack_retries(PlaceRange range, const accel::TlasView& view) noexcept {
  const auto words = retried_rays_.host_as<std::uint32_t>();
  for (std::uint32_t i = range.first; i < range.end; ++i) {
    const std::uint64_t before = std::exchange(searched_contents_[i], view.contents);
    words[i] = retry_places()[i] | (before != view.contents ? shared::ray_begins_bit : 0u);
    some_restart_ = some_restart_ || (before != 0 && before != view.contents);
  }
}

void GpuRayQuery::record(const BatchPart& part, const Recording& recording) noexcept {
  const PlaceRange range = part.range;
  if (part.is_retry)
    pack_retries(range, recording.view);
  else
    rays_.flush(range.first * sizeof(Ray), (range.end - range.first) * sizeof(Ray));
  const accel::TlasView& view = recording.view;
  const double window_s = seconds_between(view.window_begin, view.window_end);
  // Paused searches are not halted: they pause.
  const HaltAt halt = part.is_retry ? HaltAt{} : recording.halt;
  const DispatchLayout layout = spread_out(range.end - range.first, limits().processors);
  const shared::RayArgs args{.root = view.root,
                             .first = range.first,
                             .end = range.end,
                             .per_group = layout.per_group,
                             .is_retry = part.is_retry ? 1u : 0u,
                             .epoch_ns = low_word(view.epoch),
                             .late_base = view.late_base,
                             .still = options_.ignore_motion ? 1u : 0u,
                             .still_ns = low_word(recording.rows.time()),
                             .window_begin_ns = low_word(view.window_begin),
                             .per_window_ns = window_s > 0.0 ? static_cast<float>(1e-9 / window_s) : 0.0f,
                             .hits_per_ray = options_.hits_per_ray,
                             .hits = hits_[slots().written()].address(),
                             .faces = options_.faces == Faces::both    ? 0.0f
                                      : options_.faces == Faces::front ? 1.0f
                                                                       : -1.0f,
                             .halt = halt.words,
                             .halt_from = halt.from,
                             .loop_probe = 2 /* two rounds, see loops_still_turn */};
  dispatch(part.is_retry ? pausing_kernel() : kernel_for(carried_ || window_s > 0.0, view.entities),
           recording, layout, args);
}

void GpuRayQuery::unpack(const BatchPart& part, const accel::TlasView& /*view*/) noexcept {
  if (part.is_retry) {
    for (const std::uint32_t ray :
         retry_places().subspan(part.range.first, part.range.end - part.range.first))
      pull(ray, ray + 1);
    return;
  }
  pull(part.range.first, part.range.end);
  // A chunk after this one may have raised the flags; then its rays are looked at for nothing, or retried.
  const auto flags = flags_.host_as<const std::uint32_t>();
  const bool any_unanswered = flags[some_unanswered] != 0;
  if (flags[some_incomplete] == 0 && !any_unanswered) return;
  for (std::uint32_t ray = part.range.first; ray < part.range.end; ++ray) {
    if (any_unanswered)
      written_hits()[std::size_t{ray} * options_.hits_per_ray].status = HitStatus::incomplete;
    if (is_incomplete(ray)) note_incomplete(ray);
  }
}

void GpuRayQuery::pull(std::uint32_t first_ray, std::uint32_t end_ray) const noexcept {
  const std::size_t bytes_per_ray = options_.hits_per_ray * sizeof(RayHit);
  hits_[slots().written()].invalidate(first_ray * bytes_per_ray, (end_ray - first_ray) * bytes_per_ray);
}

void GpuRayQuery::mark_incomplete(std::uint32_t ray) noexcept {
  for (RayHit& hit :
       written_hits().subspan(std::size_t{ray} * options_.hits_per_ray, options_.hits_per_ray)) {
    hit = {};
    hit.status = HitStatus::incomplete;
  }
}

}  // namespace rtstdb::query
