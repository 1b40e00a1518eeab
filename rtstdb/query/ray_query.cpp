#include "rtstdb/query/ray_query.hpp"

#include <cmath>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

constexpr float largest_direction = 1e15f;

bool usable_direction(const glm::vec3& d) noexcept {
  const float largest = std::fmax(std::fmax(std::abs(d.x), std::abs(d.y)), std::abs(d.z));
  return largest >= 1e-15f && largest <= largest_direction && !std::isnan(d.x + d.y + d.z);
}

}  // namespace

Result<std::unique_ptr<GpuRayQuery>> GpuRayQuery::create(gpu::Device& device,
                                                         const RayQueryOptions& options) {
  if (options.capacity == 0 || options.capacity > max_rays_per_query) {
    return Error{ErrorCode::capacity, "ray query '" + options.name + "' asks for a capacity of " +
                                          std::to_string(options.capacity) + " rays; 1 to " +
                                          std::to_string(max_rays_per_query) + " are possible"};
  }
  auto query = std::make_unique<GpuRayQuery>();
  query->options_ = options;
  query->rays_.resize(options.capacity);
  query->hits_.resize(options.capacity);
  auto pipeline = device.create_pipeline(options.mode == RayMode::any ? gpu::ShaderId::ray_any
                                                                      : gpu::ShaderId::ray_closest);
  if (!pipeline) return pipeline.error();
  query->pipeline_ = std::move(pipeline).value();
  gpu::BufferOptions rays{.name = options.name + " rays",
                          .size_bytes = options.capacity * sizeof(shared::RayRecord),
                          .memory = gpu::Memory::upload};
  rays.texel_float4 = true;
  auto ray_records = device.create_buffer(rays);
  if (!ray_records) return ray_records.error();
  query->ray_records_ = std::move(ray_records).value();
  auto hit_records = device.create_buffer({.name = options.name + " hits",
                                           .size_bytes = options.capacity * sizeof(shared::HitRecord),
                                           .memory = gpu::Memory::readback});
  if (!hit_records) return hit_records.error();
  query->hit_records_ = std::move(hit_records).value();
  return query;
}

std::optional<BadInput> GpuRayQuery::check(std::uint32_t count, const RowSource& rows,
                                           TimeSpan& times) const noexcept {
  for (std::uint32_t i = 0; i < count; ++i) {
    const Ray& ray = rays_[i];
    if (!finite_within_limits(ray.origin_m) || !usable_direction(ray.direction) ||
        !(ray.lambda_min >= 0.0f) || !(ray.lambda_max >= ray.lambda_min)) {
      return BadInput{.reason = BadInputReason::bad_ray,
                      .element = i,
                      .entity = {},
                      .values = {ray.origin_m.x, ray.direction.x, ray.lambda_min, ray.lambda_max}};
    }
    // Where motion is ignored every ray asks at the version's own time.
    const WorldTime t = options_.ignore_motion ? rows.time() : ray.t;
    if (const auto bad = check_time(t, i, rows, times)) return bad;
    if (const auto bad = check_carrier(ray.carrier, i, rows)) return bad;
  }
  return std::nullopt;
}

Result<void> GpuRayQuery::bind(gpu::Device& device, const accel::GeometryPool& pool,
                               const accel::Tlas& tlas) {
  bindings_.clear();
  for (std::uint32_t slot = 0; slot < tlas.slots(); ++slot) {
    const gpu::Buffer* buffers[] = {&pool.nodes(), &pool.triangles(), &tlas.instances(slot), &ray_records_,
                                    &hit_records_};
    auto bindings = device.create_bindings(pipeline_, buffers);
    if (!bindings) return bindings.error();
    bindings_.push_back(std::move(bindings).value());
  }
  return {};
}

void GpuRayQuery::record_warm_up(gpu::Recorder& recorder) noexcept {
  recorder.dispatch(pipeline_, bindings_.front(), shared::RayArgs{}, 1);
}

void GpuRayQuery::record(std::uint32_t count, const RowSource& rows, const accel::Tlas& tlas,
                         const accel::TlasView& view, gpu::Recorder& recorder) noexcept {
  const auto records = ray_records_.host_as<shared::RayRecord>();
  for (std::uint32_t i = 0; i < count; ++i) {
    const Ray& ray = rays_[i];
    records[i] = {
        .origin_m = ray.origin_m,
        .lambda_min = ray.lambda_min,
        .direction = ray.direction,
        .lambda_max = ray.lambda_max,
        .t_s = static_cast<float>(seconds_between(view.window_begin, ray.t)),
        .mask = ray.mask,
        .carrier = ray.carrier.valid() ? tlas.place_of(view.slot, ray.carrier.index) : shared::no_entity,
        .reserved = 0};
  }
  const shared::RayArgs args{
      .root = view.root,
      .count = count,
      .frozen = options_.ignore_motion ? 1u : 0u,
      .frozen_t_s = static_cast<float>(seconds_between(view.window_begin, rows.time()))};
  recorder.dispatch(pipeline_, bindings_[view.slot], args, (count + 63) / 64);
}

bool GpuRayQuery::unpack(std::uint32_t count, const RowSource& rows) noexcept {
  const auto records = hit_records_.host_as<const shared::HitRecord>();
  bool truncated = false;
  for (std::uint32_t i = 0; i < count; ++i) {
    const shared::HitRecord& record = records[i];
    RayHit& hit = hits_[i];
    hit = {};
    hit.status = static_cast<HitStatus>(record.status);
    truncated = truncated || hit.status == HitStatus::incomplete;
    if (hit.status != HitStatus::hit || options_.mode == RayMode::any) continue;
    hit.lambda = record.lambda;
    hit.u = record.u;
    hit.v = record.v;
    const EntityState& state = *rows.row(record.entity);
    hit.entity = state.id;
    hit.mask = state.row.mask;
    hit.material = state.row.material;
    hit.triangle = record.triangle;
    hit.front_face = record.front_face != 0;
    hit.n_world = record.n_world;
    hit.v_relative_mps = record.v_relative_mps;
  }
  answered_ = count;
  return truncated;
}

}  // namespace rtstdb::query
