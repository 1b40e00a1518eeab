#include <glm/ext/vector_double2.hpp>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "rtstdb/oracle/nearest_point.hpp"
#include "rtstdb/oracle/oracle.hpp"
#include "rtstdb/oracle/posed_cone.hpp"
#include "rtstdb/oracle/watertight.hpp"

namespace rtstdb::oracle {
namespace {

/// Axial coordinates that differ by less than this part of the magnitudes are equal, and the lower triangle
/// wins.
constexpr double equal_relative = 1e-12;

glm::dvec3 normal_of(const std::array<glm::dvec3, 3>& c) noexcept {
  return glm::cross(c[1] - c[0], c[2] - c[0]);
}

struct FirstContact {
  bool found = false;
  std::uint32_t triangle = 0;
  glm::dvec3 p_cone_m{0.0};
};

FirstContact first_contact(const PosedCone& cone, const PosedEntity& entity, Faces faces, bool brute_force) {
  FirstContact first;
  ConeSpace space = cone.space();
  const auto look_at = [&](std::uint32_t triangle) {
    if (normal_of(entity.mesh->corners(triangle)) == glm::dvec3(0.0)) return;
    const ConeCorners corners = cone.corners(entity, triangle);
    if (!admits(faces, apex_height_m(corners), 0.0)) return;
    const auto point = first_point(corners, space);
    if (!point) return;
    const double window = equal_relative * (std::abs(point->z) + entity.reach());
    const bool nearer = !first.found || point->z < first.p_cone_m.z - window ||
                        (point->z <= first.p_cone_m.z + window && triangle < first.triangle);
    if (!nearer) return;
    first = {true, triangle, *point};
    space.z_max_m = std::min(space.z_max_m, point->z + window);
  };
  if (brute_force) {
    for (std::uint32_t i = 0; i < entity.mesh->triangle_count(); ++i)
      look_at(i);
  } else {
    cone.walk(entity, 0.0, look_at);
  }
  return first;
}

ConeTruth described(const PosedCone& cone, const PosedEntity& entity, const FirstContact& first) {
  const Motion& motion = entity.state->row.motion;
  const glm::dvec3 p_world_m = cone.in_world(first.p_cone_m);
  const TrianglePoint on_triangle = nearest_on_triangle(entity.corners_world(first.triangle), p_world_m);
  ConeTruth truth;
  truth.entity = entity.state->id;
  truth.triangle = first.triangle;
  truth.lambda = first.p_cone_m.z / cone.axis.length;
  truth.u = on_triangle.u;
  truth.v = on_triangle.v;
  truth.front_face = apex_height_m(cone.corners(entity, first.triangle)) > 0.0;
  // Normals scale inversely.
  truth.n_world = glm::normalize(entity.pose.q_world *
                                 (normal_of(entity.mesh->corners(first.triangle)) / entity.state->row.scale));
  truth.v_relative_mps = motion.v_world_mps +
                         glm::cross(motion.w_world_radps, p_world_m - entity.pose.p_world_m) -
                         cone.axis.v_origin_mps;
  truth.noise_m = cone.noise_m(entity, first.triangle);
  return truth;
}

bool is_excluded(Faces faces, const RayTruth& hit) noexcept {
  return faces != Faces::both && hit.front_face != (faces == Faces::front);
}

/// The closest hit of each entity.
std::vector<ConeTruth> hits_of_axis(const World& world, const Cone& cone, Faces faces) {
  std::vector<ConeTruth> contacts;
  for (const RayTruth& hit : trace_all(world, axis_of(cone), false)) {
    const bool listed = std::ranges::find(contacts, hit.entity, &ConeTruth::entity) != contacts.end();
    if (listed || is_excluded(faces, hit)) continue;
    contacts.push_back({hit.entity, hit.triangle, hit.lambda, hit.u, hit.v, hit.front_face, hit.n_world,
                        hit.v_relative_mps, hit.noise_m});
  }
  return contacts;
}

std::vector<ConeTruth> searched(const World& world, const Cone& cone, Faces faces, bool brute_force) {
  const PosedCone posed_cone(world, cone);
  if (posed_cone.is_ray()) return hits_of_axis(world, cone, faces);
  std::vector<ConeTruth> contacts;
  for (const EntityState& state : world.entities()) {
    if (!visible(state, cone.mask)) continue;
    const PosedEntity entity = posed(world, state, cone.t, false);
    const FirstContact first = first_contact(posed_cone, entity, faces, brute_force);
    if (first.found) contacts.push_back(described(posed_cone, entity, first));
  }
  std::ranges::sort(contacts, {},
                    [](const ConeTruth& one) { return std::tuple(one.lambda, one.entity.index); });
  return contacts;
}

/// An entity, and its triangles as a ray from the apex meets them.
struct Target {
  PosedEntity entity;
  std::size_t reached = 0;  ///< by how many directions
};

/// The nearest admitted surface of the entity along a direction from the apex, up to `limit`, which is then
/// reduced. The direction has one metre along the axis.
bool meets(const PosedCone& cone, const PosedEntity& entity, Faces faces, const glm::dvec3& direction,
           double& limit) {
  const glm::dquat to_entity = glm::conjugate(entity.pose.q_world);
  const glm::dvec3& scale = entity.state->row.scale;
  LocalRay local{(to_entity * (cone.axis.origin_m - entity.pose.p_world_m)) / scale,
                 (to_entity * direction) / scale, 0.0, limit};
  const WatertightTest test(local);
  bool any = false;
  entity.mesh->walk(local, glm::dvec3(0.0), [&](std::uint32_t triangle) {
    const auto corners = entity.mesh->corners(triangle);
    const glm::dvec3 normal = normal_of(corners);
    const auto hit = test(corners, local.lambda_min, local.lambda_max);
    const double facing = -glm::dot(normal, local.direction);
    if (!hit || normal == glm::dvec3(0.0) || !admits(faces, facing, 0.0) || hit->lambda >= limit) return;
    limit = local.lambda_max = hit->lambda;
    any = true;
  });
  return any;
}

/// Hammersley's points, mapped to the unit disc so that areas are kept.
glm::dvec2 in_disc(std::uint32_t k, std::uint32_t count) noexcept {
  double turn = 0.0;
  double digit = 0.5;
  for (std::uint32_t rest = k; rest > 0; rest /= 2, digit *= 0.5)
    turn += static_cast<double>(rest % 2) * digit;
  const double radius = std::sqrt((k + 0.5) / count);
  const double angle_rad = 2.0 * std::numbers::pi * turn;
  return {radius * std::cos(angle_rad), radius * std::sin(angle_rad)};
}

}  // namespace

std::vector<ConeTruth> contacts(const World& world, const Cone& cone, Faces faces) {
  return searched(world, cone, faces, false);
}

std::vector<ConeTruth> contacts_brute_force(const World& world, const Cone& cone, Faces faces) {
  return searched(world, cone, faces, true);
}

std::vector<BeamFraction> beam_fractions(const World& world, const Cone& cone, Faces faces,
                                         std::uint32_t directions) {
  const PosedCone posed_cone(world, cone);
  if (posed_cone.is_ray()) {
    const auto hits = hits_of_axis(world, cone, faces);
    if (hits.empty()) return {};
    return {{hits.front().entity, 1.0}};
  }
  std::vector<Target> targets;
  for (const ConeTruth& contact : contacts(world, cone, faces))
    targets.push_back({posed(world, *world.find(contact.entity), cone.t, false)});
  const double z_max_m = posed_cone.axis.lambda_max * posed_cone.axis.length;
  for (std::uint32_t k = 0; k < directions; ++k) {
    const glm::dvec2 beside = posed_cone.slope() * in_disc(k, directions);
    const glm::dvec3 direction = posed_cone.z + beside.x * posed_cone.x + beside.y * posed_cone.y;
    double limit = z_max_m;
    Target* nearest = nullptr;
    for (Target& target : targets) {
      if (meets(posed_cone, target.entity, faces, direction, limit)) nearest = &target;
    }
    if (nearest != nullptr) ++nearest->reached;
  }
  std::vector<BeamFraction> fractions;
  for (const Target& target : targets) {
    if (target.reached > 0)
      fractions.push_back(
          {target.entity.state->id, static_cast<double>(target.reached) / static_cast<double>(directions)});
  }
  std::ranges::sort(fractions, {}, [](const BeamFraction& one) { return one.entity.index; });
  return fractions;
}

}  // namespace rtstdb::oracle
