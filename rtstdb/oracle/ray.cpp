#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_ray.hpp"
#include "rtstdb/oracle/watertight.hpp"

namespace rtstdb::oracle {
namespace {

/// Hits whose lambdas differ by less than this part of the magnitudes are equal, and the lower index wins.
constexpr double tie_relative = 1e-12;

struct Candidate {
  TriangleHit hit;
  PosedEntity entity;
  std::uint32_t triangle = 0;
  auto rank() const { return std::tuple(entity.state->id.index, triangle); }
};

/// The hits that could still be the answer: those within the tie window of the closest one.
class Closest {
 public:
  bool empty() const { return kept_.empty(); }
  /// Hits beyond this lambda are not needed.
  double limit() const { return limit_; }

  void offer(const Candidate& candidate, double window) {
    if (candidate.hit.lambda > limit_) return;
    kept_.push_back(candidate);
    if (candidate.hit.lambda + window >= limit_) return;
    limit_ = candidate.hit.lambda + window;
    std::erase_if(kept_, [this](const Candidate& other) { return other.hit.lambda > limit_; });
  }
  const Candidate& best() const {
    return *std::min_element(kept_.begin(), kept_.end(),
                             [](const Candidate& a, const Candidate& b) { return a.rank() < b.rank(); });
  }

 private:
  std::vector<Candidate> kept_;
  double limit_ = std::numeric_limits<double>::infinity();
};

bool has_area(const std::array<glm::dvec3, 3>& c) {
  return glm::cross(c[1] - c[0], c[2] - c[0]) != glm::dvec3(0.0);
}

double distance_to_segment(const glm::dvec3& p, const glm::dvec3& a, const glm::dvec3& b) {
  const glm::dvec3 edge = b - a;
  const double along = std::clamp(glm::dot(p - a, edge) / glm::dot(edge, edge), 0.0, 1.0);
  return glm::length(p - (a + along * edge));
}

void collect(const PosedRay& ray, const PosedEntity& entity, bool brute_force, bool first_will_do,
             Closest& closest) {
  LocalRay local = ray.in_frame_of(entity);
  const WatertightTest meets(local);
  const double magnitude_m = glm::length(ray.origin_m) + glm::length(entity.pose.p_world_m) + entity.reach();
  local.lambda_max = std::min(local.lambda_max, closest.limit());
  const auto look_at = [&](std::uint32_t triangle) {
    if (first_will_do && !closest.empty()) return;
    const auto corners = entity.mesh->corners(triangle);
    const auto hit = meets(corners, local.lambda_min, local.lambda_max);
    if (!hit || !has_area(corners)) return;
    const double window = tie_relative * std::max(std::abs(hit->lambda), magnitude_m / ray.length);
    closest.offer({*hit, entity, triangle}, window);
    local.lambda_max = std::min(local.lambda_max, closest.limit());
  };
  if (brute_force) {
    for (std::uint32_t i = 0; i < entity.mesh->triangle_count(); ++i)
      look_at(i);
  } else {
    entity.mesh->walk(local, glm::dvec3(0.0), look_at);
  }
}

RayTruth described(const PosedRay& ray, const Candidate& best) {
  const PosedEntity& entity = best.entity;
  const Motion& motion = entity.state->row.motion;
  const glm::dvec3 hit_m = ray.origin_m + best.hit.lambda * ray.direction;
  const auto local = entity.mesh->corners(best.triangle);
  const auto corners = entity.corners_world(best.triangle);
  // Normals scale inversely.
  const glm::dvec3 normal =
      entity.pose.q_world * (glm::cross(local[1] - local[0], local[2] - local[0]) / entity.state->row.scale);

  RayTruth truth;
  truth.status = HitStatus::hit;
  truth.lambda = best.hit.lambda;
  truth.u = best.hit.u;
  truth.v = best.hit.v;
  truth.entity = entity.state->id;
  truth.triangle = best.triangle;
  truth.n_world = glm::normalize(normal);
  const double cosine = glm::dot(truth.n_world, ray.direction) / ray.length;
  truth.front_face = cosine < 0.0;
  const glm::dvec3 v_hit_mps =
      motion.v_world_mps + glm::cross(motion.w_world_radps, hit_m - entity.pose.p_world_m);
  truth.v_relative_mps = v_hit_mps - ray.v_origin_mps;
  truth.incidence_cosine = std::abs(cosine);
  truth.edge_distance_m = std::min({distance_to_segment(hit_m, corners[0], corners[1]),
                                    distance_to_segment(hit_m, corners[1], corners[2]),
                                    distance_to_segment(hit_m, corners[2], corners[0])});
  truth.noise_m = ray.noise_m(entity, truth.lambda, entity.reach());
  return truth;
}

RayTruth traced(const World& world, const Ray& ray, RayMode mode, bool ignore_motion, bool brute_force) {
  const PosedRay posed_ray(world, ray, ignore_motion);
  const bool first_will_do = mode == RayMode::any;
  Closest closest;
  for (const EntityState& state : world.entities()) {
    if (!visible(state, ray.mask)) continue;
    const PosedEntity entity = posed(world, state, ray.t, ignore_motion);
    if (!brute_force && !posed_ray.passes(entity, 0.0)) continue;
    collect(posed_ray, entity, brute_force, first_will_do, closest);
    if (first_will_do && !closest.empty()) break;
  }
  if (closest.empty()) return {};
  if (first_will_do) {
    RayTruth truth;
    truth.status = HitStatus::hit;
    return truth;
  }
  return described(posed_ray, closest.best());
}

}  // namespace

std::vector<RayTruth> trace_all(const World& world, const Ray& ray, bool ignore_motion) {
  const PosedRay posed_ray(world, ray, ignore_motion);
  std::vector<RayTruth> hits;
  for (const EntityState& state : world.entities()) {
    if (!visible(state, ray.mask)) continue;
    const PosedEntity entity = posed(world, state, ray.t, ignore_motion);
    LocalRay local = posed_ray.in_frame_of(entity);
    const WatertightTest meets(local);
    entity.mesh->walk(local, glm::dvec3(0.0), [&](std::uint32_t triangle) {
      const auto corners = entity.mesh->corners(triangle);
      const auto hit = meets(corners, local.lambda_min, local.lambda_max);
      if (hit && has_area(corners)) hits.push_back(described(posed_ray, {*hit, entity, triangle}));
    });
  }
  std::ranges::sort(
      hits, {}, [](const RayTruth& hit) { return std::tuple(hit.lambda, hit.entity.index, hit.triangle); });
  return hits;
}

RayTruth trace(const World& world, const Ray& ray, RayMode mode, bool ignore_motion) {
  return traced(world, ray, mode, ignore_motion, false);
}

RayTruth trace_brute_force(const World& world, const Ray& ray, RayMode mode, bool ignore_motion) {
  return traced(world, ray, mode, ignore_motion, true);
}

}  // namespace rtstdb::oracle
