// Judges a single-precision nearest answer: every neighbor against its own target, then the list against the
// truth.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/nearest_point.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_point.hpp"

namespace rtstdb::oracle {
namespace {

bool has_triangle(NearestTarget target) {
  return target == NearestTarget::surface || target == NearestTarget::triangle;
}

/// The nearest point of the neighbor's target; the distance of a surface is that of its nearest triangle.
struct Claim {
  PosedEntity entity;
  Measured measured;
  double distance_m = 0.0;
  double noise_m = 0.0;
};

double surface_distance_m(const PosedEntity& entity, const glm::dvec3& point_m, double at_most_m) {
  double least = at_most_m;
  entity.mesh->walk_near(
      in_frame_of(entity, point_m), entity.state->row.scale, least, [&](std::uint32_t triangle) {
        least = std::min(least, measured_to_triangle(entity, triangle, point_m).distance_m);
      });
  return least;
}

Judgement judge_uv(const Claim& claim, const Neighbor& neighbor) {
  const auto c = claim.entity.corners_world(neighbor.triangle);
  const double u = static_cast<double>(neighbor.u);
  const double v = static_cast<double>(neighbor.v);
  const glm::dvec3 named_m = (1.0 - u - v) * c[0] + u * c[1] + v * c[2];
  const double slack_m = claim.noise_m + 1e-6 * (glm::length(c[1] - c[0]) + glm::length(c[2] - c[0]));
  if (!(glm::length(named_m - glm::dvec3(neighbor.p_world_m)) <= slack_m) || u < -1e-6 || v < -1e-6 ||
      u + v > 1.0 + 1e-6)
    return judged(Verdict::differs, "u, v = (%.9g, %.9g) name another point", u, v);
  return {};
}

/// Whether the answered point lies on the target, at the answered distance.
Judgement judge_point(const Claim& claim, const PosedPoint& point, NearestTarget target,
                      const Neighbor& neighbor) {
  const glm::dvec3 p(neighbor.p_world_m);
  const double off_target_m = has_triangle(target)
                                  ? measured_to_triangle(claim.entity, neighbor.triangle, p).distance_m
                                  : measured_to(claim.entity, target, p).distance_m;
  const double from_point_m = glm::length(p - point.point_m);
  if (!(off_target_m <= claim.noise_m && std::abs(from_point_m - claim.distance_m) <= 2.0 * claim.noise_m))
    return judged(Verdict::differs, "point (%.9g, %.9g, %.9g), %.3g m off and %.9g m away instead of %.9g m",
                  p.x, p.y, p.z, off_target_m, from_point_m, claim.distance_m);
  const Motion& motion = claim.entity.state->row.motion;
  const glm::dvec3 wanted = relative_velocity(claim.entity, point, p);
  const double spin_radps = glm::length(motion.w_world_radps);
  const double speeds_mps = glm::length(motion.v_world_mps) +
                            spin_radps * glm::length(p - claim.entity.pose.p_world_m) +
                            glm::length(point.v_mps);
  const glm::dvec3 v(neighbor.v_relative_mps);
  if (!(glm::length(v - wanted) <= velocity_relative_tolerance * speeds_mps + spin_radps * claim.noise_m))
    return judged(Verdict::differs, "relative velocity (%.9g, %.9g, %.9g) instead of (%.9g, %.9g, %.9g)", v.x,
                  v.y, v.z, wanted.x, wanted.y, wanted.z);
  return has_triangle(target) ? judge_uv(claim, neighbor) : Judgement{};
}

Judgement judge_sign(const Claim& claim, const PosedPoint& point, bool is_signed, const Neighbor& neighbor) {
  const bool has_sign = is_signed && claim.entity.mesh->closed();
  if (neighbor.has_sign != has_sign)
    return judged(Verdict::differs, "a distance %s a sign", has_sign ? "without" : "with");
  if (neighbor.distance_m == 0.0f) return {};
  const bool inside = has_sign && winds_around(claim.entity, point.point_m);
  if ((neighbor.distance_m < 0.0f) == inside) return {};
  return judged(has_sign && claim.distance_m <= claim.noise_m ? Verdict::too_close : Verdict::differs,
                "distance %.9g m of a point that lies %s", static_cast<double>(neighbor.distance_m),
                inside ? "inside" : "outside");
}

/// Judges one neighbor; fills the claim as far as possible.
Judgement judge_one(const World& world, const Nearest& nearest, const NearestQueryOptions& options,
                    const PosedPoint& point, const Neighbor& neighbor, Claim& claim) {
  const EntityState* state = world.find(neighbor.entity);
  if (state == nullptr || !looked_at(*state, nearest))
    return judged(Verdict::differs, "it is unknown, masked out or excluded");
  if (neighbor.mask != state->row.mask || neighbor.material != state->row.material)
    return judged(Verdict::differs, "mask %x and material %u are not its own", neighbor.mask,
                  neighbor.material.index);
  claim.entity = posed(world, *state, nearest.t, false);
  claim.noise_m = point.noise_m(claim.entity);
  if (neighbor.triangle >= (has_triangle(options.target) ? claim.entity.mesh->triangle_count() : 1u))
    return judged(Verdict::differs, "it has no triangle %u", neighbor.triangle);
  claim.measured = has_triangle(options.target)
                       ? measured_to_triangle(claim.entity, neighbor.triangle, point.point_m)
                       : measured_to(claim.entity, options.target, point.point_m);
  claim.distance_m = claim.measured.distance_m;
  if (options.target == NearestTarget::surface) {
    claim.distance_m = surface_distance_m(claim.entity, point.point_m, claim.measured.distance_m);
    if (claim.measured.distance_m > claim.distance_m + 2.0 * claim.noise_m)
      return judged(Verdict::differs, "triangle %u is %.9g m away, another one %.9g m", neighbor.triangle,
                    claim.measured.distance_m, claim.distance_m);
  }
  const double distance_m = std::abs(static_cast<double>(neighbor.distance_m));
  if (!(std::abs(distance_m - claim.distance_m) <= claim.noise_m))
    return judged(Verdict::differs, "distance %.9g m instead of %.9g m", distance_m, claim.distance_m);
  const auto radius_m = static_cast<double>(nearest.radius_m);
  if (claim.distance_m > radius_m + claim.noise_m)
    return judged(Verdict::differs, "distance %.9g m, beyond the radius", claim.distance_m);
  if (Judgement judgement = judge_point(claim, point, options.target, neighbor);
      judgement.verdict != Verdict::agrees)
    return judgement;
  return judge_sign(claim, point, options.is_signed, neighbor);
}

bool in_order(const Neighbor& a, const Neighbor& b) {
  const auto rank = [](const Neighbor& neighbor) {
    return std::tuple(std::abs(neighbor.distance_m), neighbor.entity.index, neighbor.triangle);
  };
  return rank(a) < rank(b);
}

/// Whether neighbors are compared by entity alone, not by triangle.
bool same_target(const NeighborTruth& truth, const Neighbor& neighbor, NearestTarget target) {
  return truth.entity == neighbor.entity &&
         (target != NearestTarget::triangle || truth.triangle == neighbor.triangle);
}

}  // namespace

Judgement compare(const World& world, const Nearest& nearest, const NearestQueryOptions& options,
                  std::span<const NeighborTruth> truth, const NearestAnswer& answer) {
  if (answer.incomplete) return judged(Verdict::differs, "no answer: incomplete");
  const auto listed = answer.neighbors;
  if (listed.size() > options.k)
    return judged(Verdict::differs, "%zu neighbors, where %u were asked for", listed.size(), options.k);
  const PosedPoint point(world, nearest);
  Judgement judgement;
  double reach_m = static_cast<double>(nearest.radius_m);
  double reach_noise_m = 0.0;
  for (std::size_t i = 0; i < listed.size(); ++i) {
    Claim claim;
    const Judgement one = judge_one(world, nearest, options, point, listed[i], claim);
    if (one.verdict != Verdict::agrees)
      judgement = judged(one.verdict, "place %zu, entity %u, triangle %u: %s", i, listed[i].entity.index,
                         listed[i].triangle, one.reason.c_str());
    if (one.verdict == Verdict::differs) return judgement;
    if (i > 0 && !in_order(listed[i - 1], listed[i]))
      return judged(Verdict::differs, "place %zu, entity %u, triangle %u: out of order", i,
                    listed[i].entity.index, listed[i].triangle);
    const auto twice = std::ranges::find_if(listed.first(i), [&](const Neighbor& before) {
      return before.entity == listed[i].entity &&
             (options.target != NearestTarget::triangle || before.triangle == listed[i].triangle);
    });
    if (twice != listed.first(i).end())
      return judged(Verdict::differs, "entity %u, triangle %u stands there twice", listed[i].entity.index,
                    listed[i].triangle);
    if (i + 1 == options.k) {
      reach_m = claim.distance_m;
      reach_noise_m = claim.noise_m;
    }
  }
  for (const NeighborTruth& wanted : truth) {
    const bool found = std::ranges::any_of(
        listed, [&](const Neighbor& neighbor) { return same_target(wanted, neighbor, options.target); });
    if (!found && std::abs(wanted.distance_m) + wanted.noise_m < reach_m - reach_noise_m)
      return judged(Verdict::differs, "entity %u, triangle %u at %.9g m is missing, the reach is %.9g m",
                    wanted.entity.index, wanted.triangle, wanted.distance_m, reach_m);
  }
  if (judgement.verdict != Verdict::agrees) return judgement;
  const bool same = std::ranges::equal(truth, listed, [](const NeighborTruth& a, const Neighbor& b) {
    return a.entity == b.entity && a.triangle == b.triangle;
  });
  return same ? Judgement{} : judged(Verdict::too_close, "the same distances in another order");
}

}  // namespace rtstdb::oracle
