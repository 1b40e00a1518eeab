#include "runtime/modules/rigid_bodies/placed_bodies.hpp"

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include <algorithm>

#include <hil/numbers.hpp>

namespace hil::modules {
namespace {

/// The semi-implicit Euler method is stable for a spring k up to k h^2 / m = 4 and for a damper c up to
/// c h / m = 2. A spring and a damper act together, so the spring has half of its limit.
constexpr double max_stiffness_ratio = 2.0, max_damping_ratio = 2.0;

/// The largest eigenvalue of a symmetric matrix without negative ones.
double largest_eigenvalue(const glm::dmat3& matrix) {
  const auto trace = [](const glm::dmat3& m) { return m[0][0] + m[1][1] + m[2][2]; };
  if (!(trace(matrix) > 0.0)) return 0.0;
  glm::dmat3 power = matrix;
  for (int i = 0; i < 10; ++i) {
    power /= trace(power);
    power = power * power;
  }
  return trace(matrix * power) / trace(power);
}

/// An upper bound of the speed that a unit impulse at a corner of the body's box gives to that corner, over
/// all corners and directions.
double largest_mobility_per_kg(const MassProperties& properties, const PlacedBody& body) {
  double largest = 0.0;
  for (int i = 0; i < 8; ++i) {
    const glm::dvec3 r(i % 2 == 0 ? body.minimum_m.x : body.maximum_m.x,
                       i / 2 % 2 == 0 ? body.minimum_m.y : body.maximum_m.y,
                       i / 4 == 0 ? body.minimum_m.z : body.maximum_m.z);
    const glm::dmat3 cross(0.0, r.z, -r.y, -r.z, 0.0, r.x, r.y, -r.x, 0.0);  // cross * n = r x n
    largest = std::max(
        largest, largest_eigenvalue(glm::transpose(cross) * glm::inverse(properties.inertia_kgm2) * cross));
  }
  return 1.0 / properties.mass_kg + largest;
}

std::string text_of(double value) {
  return config::format_number(value, 6);
}

/// Empty: the body rests at a small depth.
std::string fault_of_weight(const RigidBodiesOptions& options, const MassProperties& properties,
                            const PlacedBody& body) {
  const double acceleration_mps2 = glm::length(options.gravity_mps2);
  const double depth_m = properties.mass_kg * acceleration_mps2 / options.law.stiffness_npm;
  if (depth_m <= 0.5 * body.smallest_edge_m()) return {};
  return "rests " + text_of(depth_m) + " m deep under its weight (mass " + text_of(properties.mass_kg) +
         " kg, gravity " + text_of(acceleration_mps2) + " m/s2, stiffness " +
         text_of(options.law.stiffness_npm) + " N/m), more than half of the smallest edge of its box, " +
         text_of(body.smallest_edge_m()) + " m; use a larger stiffness";
}

/// Throws SetupError if stiffness or damping is unstable for a contact between the two bodies with the
/// largest mobility.
void check_inertia(const RigidBodiesOptions& options, std::span<const PlacedBody> placed,
                   const std::string& caller, double substep_s) {
  struct Mobility {
    double per_kg = 0.0;
    std::size_t body = 0;
  };
  std::vector<Mobility> mobilities;
  for (std::size_t i = 0; i < placed.size(); ++i)
    if (options.bodies[i].properties)
      mobilities.push_back({largest_mobility_per_kg(*options.bodies[i].properties, placed[i]), i});
  std::ranges::sort(mobilities, std::greater(), &Mobility::per_kg);
  const double both_per_kg = mobilities[0].per_kg + (mobilities.size() > 1 ? mobilities[1].per_kg : 0.0);
  const double stiffness_npm = max_stiffness_ratio / (substep_s * substep_s * both_per_kg);
  const double damping_nspm = max_damping_ratio / (substep_s * both_per_kg);
  if (options.law.stiffness_npm <= stiffness_npm && options.law.damping_nspm <= damping_nspm) return;
  throw SetupError(
      caller + ": " + place_and_name(options.bodies[mobilities[0].body]) +
      " has so small an inertia for the size of its shape that a contact at a corner turns it as if its mass "
      "were " +
      text_of(1.0 / mobilities[0].per_kg) + " kg; with a substep of " + text_of(1e3 * substep_s) +
      " ms a stiffness of at most " + text_of(stiffness_npm) + " N/m and a damping of at most " +
      text_of(damping_nspm) + " N s/m are stable there, not " + text_of(options.law.stiffness_npm) +
      " N/m and " + text_of(options.law.damping_nspm) +
      " N s/m; correct the inertia, or use smaller values, more substeps or a faster task");
}

}  // namespace

double PlacedBody::diagonal_m() const noexcept {
  return glm::length(maximum_m - minimum_m);
}

double PlacedBody::smallest_edge_m() const noexcept {
  const glm::dvec3 size_m = maximum_m - minimum_m;
  return std::min({size_m.x, size_m.y, size_m.z});
}

std::string place_and_name(const RigidBodyOptions& body) {
  return body.place.file + ":" + std::to_string(body.place.line) + ":" + std::to_string(body.place.column) +
         ": '" + body.name + "'";
}

std::vector<PlacedBody> read_placed_bodies(World& world, const std::string& caller,
                                           const RigidBodiesOptions& options,
                                           std::span<const rtstdb::EntityId> entities, double substep_s) {
  rtstdb::Database& database = world.database();
  const auto reading = database.make_transaction({.max_reads = static_cast<std::uint32_t>(entities.size())});
  reading->begin({});
  for (const rtstdb::EntityId entity : entities)
    reading->read(entity);
  const rtstdb::Outcome& outcome = database.execute(*reading);
  if (!outcome.done()) throw SetupError(caller + ": " + rtstdb::describe(outcome));
  std::vector<PlacedBody> placed;
  for (std::uint32_t i = 0; i < entities.size(); ++i) {
    const rtstdb::EntityRow& row = reading->state(i)->row;
    const auto info = database.geometry_info(row.geometry);
    const RigidBodyOptions& body = options.bodies[i];
    const auto refuse = [&](const std::string& fault) {
      throw SetupError(caller + ": " + place_and_name(body) + " " + fault);
    };
    if (!info || (info->convex_parts == 0 && !info->closed))
      refuse(
          "has an open shape, or one whose triangles have not all their fronts outside, so nothing is "
          "inside it and its contacts have no depth; use a closed shape, a 'solid' or 'convex_parts'");
    if (row.mask == 0) refuse("is in no layer, so no query finds it; give it one");
    const rtstdb::Bounds bounds = world.bounds_of(entities[i]);
    placed.push_back({.row = row,
                      .minimum_m = glm::dvec3(bounds.minimum_m) * row.scale,
                      .maximum_m = glm::dvec3(bounds.maximum_m) * row.scale});
    if (!body.properties) continue;
    if (const std::string fault = fault_of_weight(options, *body.properties, placed.back()); !fault.empty())
      refuse(fault);
  }
  check_inertia(options, placed, caller, substep_s);
  return placed;
}

}  // namespace hil::modules
