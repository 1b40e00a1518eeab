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

// shaders/shared/query.h describes rays as texels and hits as pairs of words.
static_assert(sizeof(Ray) == 16 * shared::ray_texels && offsetof(Ray, direction) == 12 &&
              offsetof(Ray, lambda_min) == 24 && offsetof(Ray, t) == 32 && offsetof(Ray, mask) == 40 &&
              offsetof(Ray, carrier) == 44);
static_assert(sizeof(RayHit) == 8 * shared::hit_pairs && offsetof(RayHit, entity) == 16 &&
              offsetof(RayHit, mask) == 24 && offsetof(RayHit, triangle) == 32 &&
              offsetof(RayHit, front_face) == 36 && sizeof(bool) == 1 && offsetof(RayHit, n_world) == 40 &&
              offsetof(RayHit, v_relative_mps) == 52);

}  // namespace

Result<std::unique_ptr<GpuQuery>> make_query(gpu::Device& device, const RayQueryOptions& options) {
  if (auto checked = check_ray_options(options); !checked) return checked.error();
  return on_device(std::make_unique<GpuRayQuery>(options), device);
}

GpuRayQuery::GpuRayQuery(const RayQueryOptions& options)
    : GpuQuery(options.capacity, options.late),
      options_(options),
      search_(options.mode, options.hits_per_ray, options.capacity) {
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
  needs.buffers.push_back({&rays_,
                           {.name = options_.name + " rays",
                            .size_bytes = ray_memory_.size_bytes(),
                            .memory = gpu::Memory::upload,
                            .texel_uint4 = true,
                            .texel_float4 = true,
                            .host = &ray_memory_}});
  search_.add_needs(needs, options_.name, limits);
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
  return search_.bound_buffers(rays_, slot, pool, tlas);
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

std::uint32_t GpuRayQuery::next_retry_batch() noexcept {
  if (search_.has_paused()) return static_cast<std::uint32_t>(retry_places().size());
  search_.begin_retries();
  return advance_retries(shared::paused_rays);
}

void GpuRayQuery::record(const BatchPart& part, const Recording& recording) noexcept {
  const PlaceRange range = part.range;
  if (!part.is_retry) rays_.flush(range.first * sizeof(Ray), (range.end - range.first) * sizeof(Ray));
  const RayPass pass{.hits = hits_[slots().written()].address(),
                     .faces = options_.faces,
                     .ignore_motion = options_.ignore_motion,
                     .carried = carried_,
                     .coherent = coherent_};
  const RaySearch::Dispatch made = search_.dispatch(part, retry_places(), pass, recording, limits());
  dispatch(kernel(made.kernel), recording, made.layout, made.args);
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
  const bool any_unanswered = search_.some_unanswered();
  if (!search_.some_incomplete() && !any_unanswered) return;
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
