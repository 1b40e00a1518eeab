// Judges a single-precision ray answer. For an answer that differs from the truth, the neighbourhood of the
// ray is searched for triangles that noise could have made the answer.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <limits>
#include <optional>

#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_ray.hpp"
#include "rtstdb/oracle/watertight.hpp"

namespace rtstdb::oracle {
namespace {

/// An interval of lambda.
struct Stretch {
  double first, last;
  bool empty() const { return first > last; }
  /// Clips the interval to the half space offset + lambda * slope >= 0.
  void clip(double offset, double slope) {
    if (slope == 0.0) {
      if (offset < 0.0) first = std::numeric_limits<double>::infinity();
      return;
    }
    const double crossing = -offset / slope;
    if (slope > 0.0) {
      first = std::max(first, crossing);
    } else {
      last = std::min(last, crossing);
    }
  }
};

/// The interval in which the ray stays within noise of the triangle: between two planes beside it, three
/// planes outside its edges, and its enlarged box, which cuts off the far tips that the edge planes leave.
Stretch near_triangle(const PosedRay& ray, const std::array<glm::dvec3, 3>& c, double noise_m) {
  const double slack = noise_m / ray.length;
  Stretch stretch{ray.lambda_min - slack, ray.lambda_max + slack};
  const glm::dvec3 normal = glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]));
  const auto clip_along = [&](const glm::dvec3& inward, const glm::dvec3& border) {
    stretch.clip(glm::dot(inward, ray.origin_m - border) + noise_m, glm::dot(inward, ray.direction));
  };
  clip_along(normal, c[0]);
  clip_along(-normal, c[0]);
  for (std::size_t i = 0; i < 3; ++i)
    clip_along(glm::normalize(glm::cross(normal, c[(i + 1) % 3] - c[i])), c[i]);
  const glm::dvec3 minimum = glm::min(c[0], glm::min(c[1], c[2]));
  const glm::dvec3 maximum = glm::max(c[0], glm::max(c[1], c[2]));
  for (int axis = 0; axis < 3; ++axis) {
    glm::dvec3 inward(0.0);
    inward[axis] = 1.0;
    clip_along(inward, minimum);
    clip_along(-inward, maximum);
  }
  return stretch;
}

/// What the neighbourhood of the ray admits.
struct Neighbourhood {
  bool anything_possible = false;
  /// Where the answered triangle could be hit, if anywhere.
  std::optional<Stretch> claimed;
  /// The latest lambda of the first certain hit, which no noise can undo.
  double certain_by = std::numeric_limits<double>::infinity();
  bool certain() const { return std::isfinite(certain_by); }
};

/// Hits of edge-on triangles and of those without area are never certain.
std::optional<double> certain_lambda(const PosedRay& ray, const std::array<glm::dvec3, 3>& c,
                                     double noise_m) {
  const glm::dvec3 normal = glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0]));
  const double cosine = std::abs(glm::dot(normal, ray.direction)) / ray.length;
  if (cosine == 0.0) return std::nullopt;
  const double lambda = glm::dot(normal, c[0] - ray.origin_m) / glm::dot(normal, ray.direction);
  const double slack_m = noise_m / cosine;
  const double slack = slack_m / ray.length;
  if (!(lambda - slack >= ray.lambda_min && lambda + slack <= ray.lambda_max)) return std::nullopt;
  const glm::dvec3 point = ray.origin_m + lambda * ray.direction;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 inward = glm::normalize(glm::cross(normal, c[(i + 1) % 3] - c[i]));
    if (glm::dot(inward, point - c[i]) < slack_m) return std::nullopt;
  }
  return lambda + slack;
}

Neighbourhood explore(const World& world, const Ray& ray, bool ignore_motion, const RayHit& answer) {
  const PosedRay posed_ray(world, ray, ignore_motion);
  Neighbourhood around;
  for (const EntityState& state : world.entities()) {
    if (!visible(state, ray.mask)) continue;
    const PosedEntity entity = posed(world, state, ray.t, ignore_motion);
    const double reach_m = entity.reach();
    const double far_m = glm::length(entity.pose.p_world_m - posed_ray.origin_m) + reach_m;
    const double margin_m = posed_ray.noise_m(entity, far_m / posed_ray.length, reach_m);
    if (!posed_ray.passes(entity, margin_m)) continue;
    LocalRay local = posed_ray.in_frame_of(entity);
    local.lambda_min -= margin_m / posed_ray.length;
    local.lambda_max += margin_m / posed_ray.length;
    entity.mesh->walk(local, margin_m / state.row.scale, [&](std::uint32_t triangle) {
      const auto corners = entity.corners_world(triangle);
      if (glm::cross(corners[1] - corners[0], corners[2] - corners[0]) == glm::dvec3(0.0)) return;
      double along_m = 0.0;
      double arm_m = 0.0;
      for (const glm::dvec3& corner : corners) {
        along_m = std::max(along_m, glm::length(corner - posed_ray.origin_m));
        arm_m = std::max(arm_m, glm::length(corner - entity.pose.p_world_m));
      }
      const double noise_m = posed_ray.noise_m(entity, along_m / posed_ray.length, arm_m);
      const Stretch stretch = near_triangle(posed_ray, corners, noise_m);
      if (stretch.empty()) return;
      around.anything_possible = true;
      if (answer.entity == state.id && answer.triangle == triangle) around.claimed = stretch;
      if (const auto certain = certain_lambda(posed_ray, corners, noise_m))
        around.certain_by = std::min(around.certain_by, *certain);
    });
  }
  return around;
}

Judgement judge_disagreement(const World& world, const Ray& ray, RayMode mode, bool ignore_motion,
                             const RayTruth& truth, const RayHit& answer) {
  const Neighbourhood around = explore(world, ray, ignore_motion, answer);
  if (answer.status == HitStatus::miss) {
    const Verdict verdict = around.certain() ? Verdict::differs : Verdict::too_close;
    return judged(verdict, "a miss, where entity %u, triangle %u is hit at lambda %.9g", truth.entity.index,
                  truth.triangle, truth.lambda);
  }
  if (mode == RayMode::any)
    return judged(around.anything_possible ? Verdict::too_close : Verdict::differs,
                  "a hit, where there is none");
  const double lambda = static_cast<double>(answer.lambda);
  const double tolerance = lambda_relative_tolerance * std::abs(lambda);
  // With RayMode::first, hits in front are other entries of the list.
  const bool hidden = mode != RayMode::first && around.claimed && around.claimed->first > around.certain_by;
  const bool possible = around.claimed && lambda >= around.claimed->first - tolerance &&
                        lambda <= around.claimed->last + tolerance && !hidden;
  const Verdict verdict = possible ? Verdict::too_close : Verdict::differs;
  if (truth.status == HitStatus::miss)
    return judged(verdict, "a hit of entity %u, triangle %u at lambda %.9g, where there is none",
                  answer.entity.index, answer.triangle, lambda);
  return judged(
      verdict, "entity %u, triangle %u at lambda %.9g, where entity %u, triangle %u is hit at lambda %.9g",
      answer.entity.index, answer.triangle, lambda, truth.entity.index, truth.triangle, truth.lambda);
}

bool same_place(const PosedRay& ray, const RayTruth& truth, double lambda) {
  const double slack = truth.noise_m / (ray.length * std::max(truth.incidence_cosine, 1e-3));
  return std::abs(lambda - truth.lambda) <=
         std::max(lambda_relative_tolerance * std::abs(truth.lambda), slack);
}

/// Compares the other fields of an answer with the same triangle and place.
Judgement judge_details(const World& world, const Ray& ray, const PosedRay& posed_ray, bool ignore_motion,
                        const RayTruth& truth, const RayHit& answer) {
  const EntityState& state = *world.find(truth.entity);
  const Motion& motion = state.row.motion;
  const PosedEntity entity = posed(world, state, ray.t, ignore_motion);
  const auto c = entity.corners_world(truth.triangle);
  const glm::dvec3 e1 = c[1] - c[0];
  const glm::dvec3 e2 = c[2] - c[0];

  const double du = static_cast<double>(answer.u) - truth.u;
  const double dv = static_cast<double>(answer.v) - truth.v;
  const double slack_m = truth.noise_m / std::max(truth.incidence_cosine, 1e-3);
  if (!(glm::length(du * e1 + dv * e2) <= slack_m + 1e-5 * (glm::length(e1) + glm::length(e2))))
    return judged(Verdict::differs, "u, v = (%.9g, %.9g) instead of (%.9g, %.9g)",
                  static_cast<double>(answer.u), static_cast<double>(answer.v), truth.u, truth.v);

  const double sliver = glm::length(e1) * glm::length(e2) / glm::length(glm::cross(e1, e2));
  const double turned_rad = glm::length(motion.w_world_radps) * std::abs(entity.dt_s);
  const double tilt = normal_tolerance + noise_per_unit * (sliver + turned_rad);
  const glm::dvec3 n(answer.n_world);
  if (!(glm::length(n - truth.n_world) <= tilt))
    return judged(Verdict::differs, "normal (%.9g, %.9g, %.9g) instead of (%.9g, %.9g, %.9g)", n.x, n.y, n.z,
                  truth.n_world.x, truth.n_world.y, truth.n_world.z);
  if (answer.front_face != truth.front_face && truth.incidence_cosine > tilt)
    return judged(Verdict::differs, "the %s face instead of the other", answer.front_face ? "front" : "back");

  const glm::dvec3 v(answer.v_relative_mps);
  const glm::dvec3 hit_m = posed_ray.origin_m + truth.lambda * posed_ray.direction;
  const double spin_radps = glm::length(motion.w_world_radps);
  const double speeds_mps = glm::length(motion.v_world_mps) +
                            spin_radps * glm::length(hit_m - entity.pose.p_world_m) +
                            glm::length(posed_ray.v_origin_mps);
  if (!(glm::length(v - truth.v_relative_mps) <=
        velocity_relative_tolerance * speeds_mps + spin_radps * slack_m))
    return judged(Verdict::differs, "relative velocity (%.9g, %.9g, %.9g) instead of (%.9g, %.9g, %.9g)", v.x,
                  v.y, v.z, truth.v_relative_mps.x, truth.v_relative_mps.y, truth.v_relative_mps.z);
  return {};
}

}  // namespace

Judgement compare(const World& world, const Ray& ray, RayMode mode, bool ignore_motion, const RayTruth& truth,
                  const RayHit& answer) {
  if (answer.status != HitStatus::miss && answer.status != HitStatus::hit)
    return judged(Verdict::differs, "no answer: status %u", static_cast<unsigned>(answer.status));
  if (answer.status == truth.status && (mode == RayMode::any || answer.status == HitStatus::miss)) return {};
  if (answer.status == HitStatus::hit && truth.status == HitStatus::hit && answer.entity == truth.entity &&
      answer.triangle == truth.triangle) {
    const PosedRay posed_ray(world, ray, ignore_motion);
    if (same_place(posed_ray, truth, static_cast<double>(answer.lambda)))
      return judge_details(world, ray, posed_ray, ignore_motion, truth, answer);
  }
  return judge_disagreement(world, ray, mode, ignore_motion, truth, answer);
}

}  // namespace rtstdb::oracle
