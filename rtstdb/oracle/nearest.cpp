#include <glm/geometric.hpp>

#include <algorithm>
#include <limits>
#include <tuple>

#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_point.hpp"

namespace rtstdb::oracle {
namespace {

/// Distances that differ by less than this part of the magnitudes are equal, and the lower index wins.
constexpr double tie_relative = 1e-12;

struct Candidate {
  Measured measured;
  PosedEntity entity;
  auto rank() const { return std::tuple(entity.state->id.index, measured.triangle); }
};

/// The candidates that could still be among the k nearest: those within the tie window of the k-th.
class Ranking {
 public:
  Ranking(std::size_t k, double radius_m) : k_(k), limit_(radius_m) {}
  /// Candidates beyond this distance are not needed.
  const double& limit() const { return limit_; }

  void offer(const Candidate& candidate, double window) {
    if (candidate.measured.distance_m > limit_) return;
    const auto place = std::ranges::upper_bound(kept_, candidate.measured.distance_m, {}, distance_of);
    kept_.insert(place, candidate);
    if (kept_.size() < k_) return;
    limit_ = std::min(limit_, distance_of(kept_[k_ - 1]) + window);
    std::erase_if(kept_, [this](const Candidate& other) { return distance_of(other) > limit_; });
  }

  /// The k nearest; equal distances by index.
  std::vector<Candidate> best(double window) {
    for (auto first = kept_.begin(); first != kept_.end();) {
      auto last = first + 1;
      while (last != kept_.end() && distance_of(*last) <= distance_of(*(last - 1)) + window)
        ++last;
      std::sort(first, last, [](const Candidate& a, const Candidate& b) { return a.rank() < b.rank(); });
      first = last;
    }
    if (kept_.size() > k_) kept_.erase(kept_.begin() + static_cast<std::ptrdiff_t>(k_), kept_.end());
    return std::move(kept_);
  }

 private:
  static double distance_of(const Candidate& candidate) { return candidate.measured.distance_m; }

  std::size_t k_;
  double limit_;
  std::vector<Candidate> kept_;
};

/// The entity's triangles within the ranking's limit, or all of them.
template <class Visit>
void each_triangle(const PosedEntity& entity, const PosedPoint& point, const double& limit, bool brute_force,
                   Visit&& visit) {
  if (brute_force) {
    for (std::uint32_t i = 0; i < entity.mesh->triangle_count(); ++i)
      visit(measured_to_triangle(entity, i, point.point_m));
    return;
  }
  entity.mesh->walk_near(
      in_frame_of(entity, point.point_m), entity.state->row.scale, limit,
      [&](std::uint32_t triangle) { visit(measured_to_triangle(entity, triangle, point.point_m)); });
}

void collect(const PosedEntity& entity, const PosedPoint& point, NearestTarget target, bool brute_force,
             double window, Ranking& ranking) {
  switch (target) {
    case NearestTarget::center:
    case NearestTarget::bounds:
      ranking.offer({measured_to(entity, target, point.point_m), entity}, window);
      return;
    case NearestTarget::triangle:
      each_triangle(entity, point, ranking.limit(), brute_force, [&](const Measured& measured) {
        ranking.offer({measured, entity}, window);
      });
      return;
    case NearestTarget::surface: {
      Ranking own(1, ranking.limit());
      each_triangle(entity, point, own.limit(), brute_force, [&](const Measured& measured) {
        own.offer({measured, entity}, window);
      });
      for (const Candidate& best : own.best(window))
        ranking.offer(best, window);
      return;
    }
  }
}

NeighborTruth described(const PosedPoint& point, const Candidate& candidate, bool is_signed) {
  const PosedEntity& entity = candidate.entity;
  const Measured& measured = candidate.measured;
  NeighborTruth truth;
  truth.entity = entity.state->id;
  truth.triangle = measured.triangle;
  truth.has_sign = is_signed && entity.mesh->closed();
  const bool inside = truth.has_sign && winds_around(entity, point.point_m);
  truth.distance_m = inside ? -measured.distance_m : measured.distance_m;
  truth.u = measured.u;
  truth.v = measured.v;
  truth.p_world_m = measured.p_world_m;
  truth.v_relative_mps = relative_velocity(entity, point, measured.p_world_m);
  truth.noise_m = point.noise_m(entity);
  return truth;
}

std::vector<NeighborTruth> searched(const World& world, const Nearest& nearest,
                                    const NearestQueryOptions& options, bool brute_force) {
  const PosedPoint point(world, nearest);
  Ranking ranking(options.k, static_cast<double>(nearest.radius_m));
  double window = tie_relative * glm::length(point.point_m);
  for (const EntityState& state : world.entities()) {
    if (!looked_at(state, nearest)) continue;
    const PosedEntity entity = posed(world, state, nearest.t, false);
    const double magnitude_m =
        glm::length(point.point_m) + glm::length(entity.pose.p_world_m) + entity.reach();
    window = std::max(window, tie_relative * magnitude_m);
    const double at_least_m = glm::length(entity.pose.p_world_m - point.point_m) - entity.reach() - window;
    if (!brute_force && at_least_m > ranking.limit()) continue;
    collect(entity, point, options.target, brute_force, window, ranking);
  }
  std::vector<NeighborTruth> truth;
  for (const Candidate& candidate : ranking.best(window))
    truth.push_back(described(point, candidate, options.is_signed));
  return truth;
}

}  // namespace

std::vector<NeighborTruth> nearest(const World& world, const Nearest& point,
                                   const NearestQueryOptions& options) {
  return searched(world, point, options, false);
}

std::vector<NeighborTruth> nearest_brute_force(const World& world, const Nearest& point,
                                               const NearestQueryOptions& options) {
  return searched(world, point, options, true);
}

}  // namespace rtstdb::oracle
