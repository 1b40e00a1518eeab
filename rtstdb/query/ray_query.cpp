#include "rtstdb/query/ray_query.hpp"

#include <algorithm>
#include <cmath>

#include <rtstdb/limits.hpp>

#include "rtstdb/query/element_check.hpp"
#include "shaders/shared/query.h"

namespace rtstdb::query {
namespace {

/// Between these no product of the search leaves single precision.
constexpr float smallest_direction = 1e-15f;
constexpr float largest_direction = 1e15f;

std::optional<BadInput> check_direction(const glm::vec3& d, std::uint32_t element) noexcept {
  const glm::vec4 values(d, 0.0f);
  if (!std::isfinite(d.x) || !std::isfinite(d.y) || !std::isfinite(d.z))
    return refused(BadInputReason::not_finite, element, values);
  const float largest = std::max({std::abs(d.x), std::abs(d.y), std::abs(d.z)});
  if (largest < smallest_direction || largest > largest_direction)
    return refused(BadInputReason::bad_ray, element, values);
  return std::nullopt;
}

/// NaN is in no range.
bool is_range(float lambda_min, float lambda_max) noexcept {
  return lambda_min >= 0.0f && lambda_max >= lambda_min && std::isfinite(lambda_min);
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
  // What the device can not hold has been refused by now.
  query->rays_.resize(options.capacity);
  query->hits_.resize(options.capacity);
  query->incomplete_.reserve(options.capacity);
  return query;
}

std::optional<BadInput> GpuRayQuery::check(std::uint32_t count, const RowSource& rows,
                                           TimeSpan& times) const noexcept {
  EntityId known_carrier;  // most batches have one
  for (std::uint32_t i = 0; i < count; ++i) {
    const Ray& ray = rays_[i];
    if (const auto bad = check_point(ray.origin_m, i)) return bad;
    if (const auto bad = check_direction(ray.direction, i)) return bad;
    if (!is_range(ray.lambda_min, ray.lambda_max))
      return refused(BadInputReason::bad_ray, i, {ray.lambda_min, ray.lambda_max, 0.0f, 0.0f});
    // Where motion is ignored every ray asks at the version's own time.
    const WorldTime t = options_.ignore_motion ? rows.time() : ray.t;
    if (const auto bad = check_time(t, i, rows, times)) return bad;
    if (ray.carrier == known_carrier) continue;
    if (const auto bad = check_carrier(ray.carrier, i, rows)) return bad;
    known_carrier = ray.carrier;
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
    const accel::Moment moment = view.moment(options_.ignore_motion ? rows.time() : ray.t);
    records[i] = {
        .origin_m = ray.origin_m,
        .lambda_min = ray.lambda_min,
        .direction = ray.direction,
        .lambda_max = ray.lambda_max,
        .t_s = moment.t_s,
        .mask = ray.mask,
        .carrier = ray.carrier.valid() ? tlas.place_of(view.slot, ray.carrier.index) : shared::no_entity,
        .instance_base = moment.instance_base};
  }
  dispatch(count, false, view, recorder);
}

void GpuRayQuery::dispatch(std::uint32_t count, bool alone, const accel::TlasView& view,
                           gpu::Recorder& recorder) noexcept {
  const shared::RayArgs args{.root = view.root, .count = count, .alone = alone ? 1u : 0u, .two = 2};
  recorder.dispatch(pipeline_, bindings_[view.slot], args, alone ? count : (count + 63) / 64);
}

void GpuRayQuery::unpack(std::uint32_t count, const accel::TlasView& view) noexcept {
  incomplete_.clear();
  for (std::uint32_t i = 0; i < count; ++i) {
    unpack_hit(i, i, view);
    if (hits_[i].status == HitStatus::incomplete) incomplete_.push_back(i);
  }
  answered_ = count;
  truncated_ = !incomplete_.empty();
}

void GpuRayQuery::record_again(const accel::TlasView& view, gpu::Recorder& recorder) noexcept {
  const auto records = ray_records_.host_as<shared::RayRecord>();
  for (std::uint32_t i = 0; i < incomplete_.size(); ++i)
    records[i] = records[incomplete_[i]];
  dispatch(static_cast<std::uint32_t>(incomplete_.size()), true, view, recorder);
}

void GpuRayQuery::unpack_again(const accel::TlasView& view) noexcept {
  truncated_ = false;
  for (std::uint32_t i = 0; i < incomplete_.size(); ++i) {
    unpack_hit(incomplete_[i], i, view);
    truncated_ = truncated_ || hits_[incomplete_[i]].status == HitStatus::incomplete;
  }
}

void GpuRayQuery::unpack_hit(std::uint32_t ray, std::uint32_t place, const accel::TlasView& view) noexcept {
  const shared::HitRecord& record = hit_records_.host_as<const shared::HitRecord>()[place];
  RayHit& hit = hits_[ray];
  hit = {};
  hit.status = static_cast<HitStatus>(record.status);
  if (hit.status != HitStatus::hit || options_.mode == RayMode::any) return;
  hit.lambda = record.lambda;
  hit.u = record.u;
  hit.v = record.v;
  const accel::Identity& identity = view.identities[record.entity];
  hit.entity = identity.id;
  hit.mask = identity.mask;
  hit.material = identity.material;
  hit.triangle = record.triangle;
  hit.front_face = record.front_face != 0;
  hit.n_world = record.n_world;
  hit.v_relative_mps = record.v_relative_mps;
}

}  // namespace rtstdb::query
