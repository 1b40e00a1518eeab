#include "runtime/modules/camera/visible_share.hpp"

#include <algorithm>
#include <utility>

#include <rtstdb/limits.hpp>

namespace hil::modules {
namespace {

/// A surface may be nearer in a ray's single precision than the image's depth.
constexpr double depth_slack = 1e-5;

enum class Coverage : std::uint8_t { none, hidden, undecided };

Coverage coverage_of(rtstdb::EntityId entity, std::span<const rtstdb::RayHit> hits) noexcept {
  for (const rtstdb::RayHit& hit : hits) {
    if (hit.status == rtstdb::HitStatus::incomplete) return Coverage::undecided;
    if (hit.status == rtstdb::HitStatus::miss) return Coverage::none;
    if (hit.entity == entity) return Coverage::hidden;
  }
  return Coverage::undecided;  // the list is full
}

}  // namespace

void VisibleShare::prepare(rtstdb::Database& database, const std::string& name, const std::string& caller) {
  database_ = &database;
  auto rays = database.prepare(rtstdb::RayQueryOptions{.name = name,
                                                       .capacity = batch,
                                                       .mode = rtstdb::RayMode::first,
                                                       .hits_per_ray = rtstdb::max_hits_per_ray});
  if (!rays) throw RefusedByDatabase(caller, rays.error());
  rays_ = std::move(rays).value();
  transaction_ = database.make_transaction({.max_queries = 1});
  body_of_ray_.resize(batch);
}

void VisibleShare::count(WorldStep& context, const rtstdb::Terms& terms, const CameraView& view,
                         const rtstdb::Image& image, std::span<CoveredBody> bodies) noexcept {
  filled_ = 0;
  for (std::uint32_t number = 0; number < bodies.size(); ++number) {
    const CoveredBody& body = bodies[number];
    for (std::uint32_t row = 0; row < view.height; ++row) {
      const BoxInRow box(view, body.box, row);
      for (std::uint32_t column = box.first_column(); column < box.end_column(); ++column) {
        const std::size_t pixel = std::size_t{row} * view.width + column;
        const rtstdb::EntityId shown = image.entities[pixel];
        if (!shown.valid() || shown == body.entity) continue;
        const auto depths = box.depths(column);
        const double shown_m = static_cast<double>(image.depth_m[pixel]) * (1.0 - depth_slack);
        if (!depths || depths->last_m < shown_m) continue;
        rtstdb::Ray ray = rtstdb::pixel_ray(view.camera, view.width, view.height, column, row);
        ray.lambda_min = static_cast<float>(std::max(depths->first_m, shown_m));
        ray.lambda_max = std::max(static_cast<float>(depths->last_m), ray.lambda_min);
        rays_->rays()[filled_] = ray;
        body_of_ray_[filled_] = number;
        if (++filled_ == batch) search(context, terms, bodies);
      }
    }
  }
  if (filled_ > 0) search(context, terms, bodies);
}

void VisibleShare::search(WorldStep& context, const rtstdb::Terms& terms,
                          std::span<CoveredBody> bodies) noexcept {
  transaction_->begin(terms);
  transaction_->add_query(*rays_, filled_);
  const bool done = context.execute(*database_, *transaction_).done();
  const std::span<const rtstdb::RayHit> hits = std::as_const(*rays_).hits();
  for (std::uint32_t ray = 0; ray < filled_; ++ray) {
    CoveredBody& body = bodies[body_of_ray_[ray]];
    const Coverage coverage =
        done ? coverage_of(body.entity, hits.subspan(std::size_t{ray} * rtstdb::max_hits_per_ray,
                                                     rtstdb::max_hits_per_ray))
             : Coverage::undecided;
    if (coverage == Coverage::hidden) ++body.hidden;
    if (coverage == Coverage::undecided) ++body.undecided;
  }
  filled_ = 0;
}

}  // namespace hil::modules
