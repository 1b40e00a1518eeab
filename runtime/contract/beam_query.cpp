#include <utility>

#include <hil/world/beam_query.hpp>
#include <rtstdb/limits.hpp>

namespace hil::modules {

std::uint32_t BeamQuery::max_capacity(double divergence_rad) noexcept {
  return divergence_rad > 0.0 ? rtstdb::max_cones_per_query : rtstdb::max_rays_per_query;
}

rtstdb::Result<std::unique_ptr<BeamQuery>> BeamQuery::prepare(rtstdb::Database& database,
                                                              const BeamQueryOptions& options) {
  std::unique_ptr<BeamQuery> query(new BeamQuery);
  if (options.divergence_rad > 0.0) {
    auto cones = database.prepare(rtstdb::ConeQueryOptions{.name = options.name,
                                                           .capacity = options.capacity,
                                                           .returns_per_cone = options.returns_per_beam,
                                                           .mode = options.mode,
                                                           .fractions = true});
    if (!cones) return cones.error();
    query->cones_ = std::move(cones).value();
    query->divergence_rad_ = static_cast<float>(options.divergence_rad);
    query->returns_per_beam_ = options.returns_per_beam;
    return query;
  }
  auto rays = database.prepare(rtstdb::RayQueryOptions{.name = options.name,
                                                       .capacity = options.capacity,
                                                       .mode = rtstdb::RayMode::closest,
                                                       .ignore_motion = options.ignore_motion});
  if (!rays) return rays.error();
  query->rays_ = std::move(rays).value();
  return query;
}

void BeamQuery::set(std::uint32_t beam, const rtstdb::Ray& ray) noexcept {
  if (rays_) {
    rays_->rays()[beam] = ray;
    return;
  }
  cones_->cones()[beam] = {.origin_m = ray.origin_m,
                           .direction = ray.direction,
                           .opening_angle_rad = divergence_rad_,
                           .lambda_max = ray.lambda_max,
                           .t = ray.t,
                           .mask = ray.mask,
                           .carrier = ray.carrier};
}

void BeamQuery::add_to(rtstdb::Transaction& transaction, std::uint32_t count) noexcept {
  if (rays_) {
    transaction.add_query(*rays_, count);
  } else {
    transaction.add_query(*cones_, count);
  }
}

BeamReturn BeamQuery::at(std::uint32_t beam, std::uint32_t ordinal) const noexcept {
  if (rays_) return {.hit = std::as_const(*rays_).hits()[beam]};
  const rtstdb::ConeReturn& one =
      std::as_const(*cones_).returns()[std::size_t{beam} * returns_per_beam_ + ordinal];
  return {.hit = {.status = one.status,
                  .lambda = one.lambda,
                  .u = one.u,
                  .v = one.v,
                  .entity = one.entity,
                  .mask = one.mask,
                  .material = one.material,
                  .triangle = one.triangle,
                  .front_face = one.front_face,
                  .n_world = one.n_world,
                  .v_relative_mps = one.v_relative_mps},
          .fraction = one.fraction};
}

bool BeamQuery::overflowed(std::uint32_t beam) const noexcept {
  return cones_ && std::as_const(*cones_).returns()[std::size_t{beam} * returns_per_beam_].overflow;
}

}  // namespace hil::modules
