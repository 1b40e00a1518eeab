// Judges the returns of a cone: every return against its own entity, then the list against the truth.

#include <glm/ext/vector_double2.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <tuple>

#include <rtstdb/limits.hpp>

#include "rtstdb/oracle/judged.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_cone.hpp"

namespace rtstdb::oracle {
namespace {

constexpr double never = std::numeric_limits<double>::infinity();

/// Between which axial coordinates the first contact with an entity is.
struct ContactRange {
  double first_m = never;  ///< where it may be at the earliest
  double last_m = never;   ///< where it certainly is at the latest
};

/// The first contacts with cones that are wider and narrower by the noise.
ContactRange contact_bounds(const PosedCone& cone, const PosedEntity& entity, Faces faces) {
  ContactRange bounds;
  const double margin_m = cone.noise_m(entity);
  cone.walk(entity, margin_m, [&](std::uint32_t triangle) {
    const ConeCorners corners = cone.corners(entity, triangle);
    if (glm::cross(corners[1] - corners[0], corners[2] - corners[0]) == glm::dvec3(0.0)) return;
    const double noise_m = cone.noise_m(entity, triangle);
    const double height_m = apex_height_m(corners);
    if (!admits(faces, height_m, noise_m)) return;
    if (const auto point = first_point(corners, cone.space(noise_m)))
      bounds.first_m = std::min(bounds.first_m, point->z - noise_m);
    if (!admits(faces, height_m, -noise_m)) return;
    if (const auto point = first_point(corners, cone.space(-noise_m)))
      bounds.last_m = std::min(bounds.last_m, point->z + noise_m);
  });
  return bounds;
}

Judgement judge_velocity(const PosedCone& cone, const PosedEntity& entity, const glm::dvec3& p_world_m,
                         double noise_m, const ConeReturn& one) {
  const Motion& motion = entity.state->row.motion;
  const glm::dvec3 arm_m = p_world_m - entity.pose.p_world_m;
  const glm::dvec3 wanted =
      motion.v_world_mps + glm::cross(motion.w_world_radps, arm_m) - cone.axis.v_origin_mps;
  const double spin_radps = glm::length(motion.w_world_radps);
  const double speeds_mps =
      glm::length(motion.v_world_mps) + spin_radps * glm::length(arm_m) + glm::length(cone.axis.v_origin_mps);
  const glm::dvec3 v(one.v_relative_mps);
  if (glm::length(v - wanted) <= velocity_relative_tolerance * speeds_mps + spin_radps * noise_m) return {};
  return judged(Verdict::differs, "relative velocity (%.9g, %.9g, %.9g) instead of (%.9g, %.9g, %.9g)", v.x,
                v.y, v.z, wanted.x, wanted.y, wanted.z);
}

Judgement judge_normal(const PosedEntity& entity, const ConeReturn& one) {
  const auto c = entity.corners_world(one.triangle);
  const glm::dvec3 e1 = c[1] - c[0];
  const glm::dvec3 e2 = c[2] - c[0];
  const glm::dvec3 across = glm::cross(e1, e2);
  const double sliver = glm::length(e1) * glm::length(e2) / glm::length(across);
  const double turned_rad = glm::length(entity.state->row.motion.w_world_radps) * std::abs(entity.dt_s);
  const glm::dvec3 wanted = glm::normalize(across);
  const glm::dvec3 n(one.n_world);
  if (glm::length(n - wanted) <= normal_tolerance + noise_per_unit * (sliver + turned_rad)) return {};
  return judged(Verdict::differs, "normal (%.9g, %.9g, %.9g) instead of (%.9g, %.9g, %.9g)", n.x, n.y, n.z,
                wanted.x, wanted.y, wanted.z);
}

/// The answered point on the answered triangle.
Judgement judge_point(const PosedCone& cone, const PosedEntity& entity, Faces faces, const ConeReturn& one) {
  const auto c = entity.corners_world(one.triangle);
  const double u = static_cast<double>(one.u);
  const double v = static_cast<double>(one.v);
  const double size_m = glm::length(c[1] - c[0]) + glm::length(c[2] - c[0]);
  const double noise_m = cone.noise_m(entity, one.triangle) + 1e-6 * size_m;
  const glm::dvec3 p_world_m = (1.0 - u - v) * c[0] + u * c[1] + v * c[2];
  const glm::dvec3 p = cone.in_cone(p_world_m);
  const double z = static_cast<double>(one.lambda) * cone.axis.length;
  const double outside_m = (glm::length(glm::dvec2(p)) - cone.slope() * p.z) * std::cos(cone.half_angle_rad);
  if (!(u >= -1e-5 && v >= -1e-5 && u + v <= 1.0 + 1e-5) || !(outside_m <= 2.0 * noise_m))
    return judged(Verdict::differs, "u, v = (%.9g, %.9g) name a point %.3g m outside", u, v, outside_m);
  if (!(std::abs(p.z - z) <= lambda_relative_tolerance * z + 4.0 * noise_m))
    return judged(Verdict::differs, "u, v = (%.9g, %.9g) name a point at %.9g m instead of %.9g m", u, v, p.z,
                  z);
  const double height_m = apex_height_m(cone.corners(entity, one.triangle));
  if (!admits(faces, height_m, noise_m) ||
      (one.front_face != (height_m > 0.0) && std::abs(height_m) > noise_m))
    return judged(Verdict::differs, "the %s face, with the apex %.3g m in front of it",
                  one.front_face ? "front" : "back", height_m);
  if (Judgement judgement = judge_velocity(cone, entity, p_world_m, noise_m, one);
      judgement.verdict != Verdict::agrees)
    return judgement;
  return judge_normal(entity, one);
}

Judgement judge_one(const World& world, const Cone& cone, const PosedCone& posed_cone, Faces faces,
                    const ConeReturn& one) {
  const EntityState* state = world.find(one.entity);
  if (state == nullptr || !visible(*state, cone.mask))
    return judged(Verdict::differs, "it is unknown or masked out");
  if (one.mask != state->row.mask || one.material != state->row.material)
    return judged(Verdict::differs, "mask %x and material %u are not its own", one.mask, one.material.index);
  const PosedEntity entity = posed(world, *state, cone.t, false);
  if (one.triangle >= entity.mesh->triangle_count())
    return judged(Verdict::differs, "it has no triangle %u", one.triangle);
  if (Judgement judgement = judge_point(posed_cone, entity, faces, one); judgement.verdict != Verdict::agrees)
    return judgement;
  const ContactRange bounds = contact_bounds(posed_cone, entity, faces);
  const double z = static_cast<double>(one.lambda) * posed_cone.axis.length;
  const double slack_m = lambda_relative_tolerance * z;
  if (z >= bounds.first_m - slack_m && z <= bounds.last_m + slack_m) return {};
  return judged(Verdict::differs, "contact at %.9g m, where it is between %.9g m and %.9g m", z,
                bounds.first_m, bounds.last_m);
}

bool in_order(const ConeReturn& a, const ConeReturn& b) {
  return std::tuple(a.lambda, a.entity.index) < std::tuple(b.lambda, b.entity.index);
}

bool is_listed(std::span<const ConeReturn> listed, EntityId entity) {
  return std::ranges::find(listed, entity, &ConeReturn::entity) != listed.end();
}

double last_m(std::span<const ConeReturn> listed, std::size_t places, const PosedCone& cone) {
  return listed.size() < places ? never : static_cast<double>(listed.back().lambda) * cone.axis.length;
}

/// An entity that must be listed and is not.
Judgement judge_missing(const World& world, const Cone& cone, const PosedCone& posed_cone, Faces faces,
                        std::span<const ConeTruth> truth, std::span<const ConeReturn> listed,
                        std::size_t places) {
  const double before_m = last_m(listed, places, posed_cone);
  for (const ConeTruth& one : truth) {
    if (is_listed(listed, one.entity)) continue;
    const PosedEntity entity = posed(world, *world.find(one.entity), cone.t, false);
    const double certain_m = contact_bounds(posed_cone, entity, faces).last_m;
    if (certain_m < never && certain_m < before_m * (1.0 - lambda_relative_tolerance))
      return judged(Verdict::differs, "entity %u at lambda %.9g is missing", one.entity.index, one.lambda);
  }
  return {};
}

Judgement judge_fractions(const World& world, const Cone& cone, const PosedCone& posed_cone, Faces faces,
                          std::span<const ConeTruth> truth, std::span<const ConeReturn> listed,
                          std::size_t places) {
  const auto fractions = beam_fractions(world, cone, faces, judged_directions);
  const auto sampled = [&](EntityId entity) {
    const auto found = std::ranges::find(fractions, entity, &BeamFraction::entity);
    return found == fractions.end() ? 0.0 : found->fraction;
  };
  double sum = 0.0;
  for (const ConeReturn& one : listed) {
    const double fraction = static_cast<double>(one.fraction);
    const double wanted = sampled(one.entity);
    sum += fraction;
    if (fraction > 0.0 && std::abs(fraction - wanted) <= fraction_tolerance) continue;
    return judged(Verdict::differs, "entity %u gets %.4g of the beam instead of %.4g", one.entity.index,
                  fraction, wanted);
  }
  if (sum > 1.0 + 1e-5) return judged(Verdict::differs, "fractions sum to %.9g", sum);
  const double before_m = last_m(listed, places, posed_cone);
  for (const ConeTruth& one : truth.first(std::min<std::size_t>(truth.size(), max_entities_per_beam))) {
    const bool is_before = one.lambda * posed_cone.axis.length < before_m * (1.0 - lambda_relative_tolerance);
    if (is_listed(listed, one.entity) || !is_before || sampled(one.entity) <= fraction_tolerance) continue;
    return judged(Verdict::differs, "entity %u is missing, which gets %.4g of the beam", one.entity.index,
                  sampled(one.entity));
  }
  return {};
}

/// Whether the beam is so thin that noise decides what it meets.
bool is_thin(const PosedCone& cone, std::span<const ConeTruth> truth) {
  return std::ranges::any_of(truth, [&](const ConeTruth& one) {
    return cone.slope() * one.lambda * cone.axis.length < 10.0 * one.noise_m;
  });
}

/// The returns are those of the truth.
bool agree(const PosedCone& cone, bool fractions, std::span<const ConeTruth> truth,
           std::span<const ConeReturn> listed, std::size_t places) {
  std::size_t next = 0;
  for (const ConeReturn& one : listed) {
    // With fractions, entities that nothing reaches are left out.
    while (fractions && next < truth.size() && truth[next].entity != one.entity)
      ++next;
    if (next == truth.size() || truth[next].entity != one.entity) return false;
    const double difference = std::abs(static_cast<double>(one.lambda) - truth[next].lambda);
    if (difference >
        std::max(lambda_relative_tolerance * truth[next].lambda, truth[next].noise_m / cone.axis.length))
      return false;
    ++next;
  }
  return fractions || listed.size() == std::min(truth.size(), places);
}

RayHit as_hit(const ConeReturn& one) {
  return {.status = one.status,
          .lambda = one.lambda,
          .u = one.u,
          .v = one.v,
          .entity = one.entity,
          .mask = one.mask,
          .material = one.material,
          .triangle = one.triangle,
          .front_face = one.front_face,
          .n_world = one.n_world,
          .v_relative_mps = one.v_relative_mps};
}

/// A cone without an opening, by what is known of rays: its first return, and the order of the others.
Judgement judge_ray(const World& world, const Cone& cone, const ConeQueryOptions& options,
                    std::span<const ConeReturn> answers) {
  const Ray ray = axis_of(cone);
  if (options.faces != Faces::both) return {};
  return compare(world, ray, RayMode::closest, false, trace(world, ray), as_hit(answers.front()));
}

}  // namespace

Judgement compare(const World& world, const Cone& cone, const ConeQueryOptions& options,
                  std::span<const ConeTruth> truth, std::span<const ConeReturn> answers) {
  const PosedCone posed_cone(world, cone);
  const auto end =
      std::ranges::find_if(answers, [](const ConeReturn& one) { return one.status != HitStatus::hit; });
  const auto listed = answers.first(static_cast<std::size_t>(end - answers.begin()));
  for (const ConeReturn& one : answers.subspan(listed.size())) {
    if (one.status != HitStatus::miss)
      return judged(Verdict::differs, "no answer: status %u", static_cast<unsigned>(one.status));
  }
  if (posed_cone.is_ray()) return judge_ray(world, cone, options, answers);
  for (std::size_t i = 0; i < listed.size(); ++i) {
    const Judgement one = judge_one(world, cone, posed_cone, options.faces, listed[i]);
    if (one.verdict != Verdict::agrees)
      return judged(one.verdict, "return %zu, entity %u, triangle %u: %s", i, listed[i].entity.index,
                    listed[i].triangle, one.reason.c_str());
    if (i > 0 && (!in_order(listed[i - 1], listed[i]) || is_listed(listed.first(i), listed[i].entity)))
      return judged(Verdict::differs, "return %zu, entity %u is out of order or listed twice", i,
                    listed[i].entity.index);
  }
  if (options.fractions && is_thin(posed_cone, truth))
    return judged(Verdict::too_close, "a beam that is not wider than noise");
  const bool overflow = !answers.empty() && answers.front().overflow;
  Judgement list =
      overflow ? Judgement{}
      : options.fractions
          ? judge_fractions(world, cone, posed_cone, options.faces, truth, listed, answers.size())
          : judge_missing(world, cone, posed_cone, options.faces, truth, listed, answers.size());
  if (list.verdict != Verdict::agrees) return list;
  return agree(posed_cone, options.fractions, truth, listed, answers.size())
             ? Judgement{}
             : judged(Verdict::too_close, "what is within noise of the cone's border");
}

}  // namespace rtstdb::oracle
