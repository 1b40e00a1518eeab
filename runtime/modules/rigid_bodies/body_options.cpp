#include "runtime/modules/rigid_bodies/body_options.hpp"

#include <algorithm>

#include <hil/numbers.hpp>
#include <hil/world/vector_parameter.hpp>
#include <rtstdb/limits.hpp>

namespace hil::modules {
namespace {

using config::Field;
using config::Quantity;
using config::Schema;
using config::Value;

glm::dmat3 diagonal(double xx, double yy, double zz) {
  return {glm::dvec3(xx, 0.0, 0.0), glm::dvec3(0.0, yy, 0.0), glm::dvec3(0.0, 0.0, zz)};
}

/// Of a homogeneous solid, or the given moments.
glm::dmat3 inertia_of(const Value& inertia, double mass_kg) {
  const std::string& kind = inertia.chosen();
  const Value& value = inertia[kind];
  if (kind == "box") {
    const glm::dvec3 s = vector_of(value);
    const glm::dvec3 squares = s * s;
    const double factor = mass_kg / 12.0;
    return diagonal(factor * (squares.y + squares.z), factor * (squares.x + squares.z),
                    factor * (squares.x + squares.y));
  }
  if (kind == "cylinder") {
    const double r = value["radius"].number(), h = value["height"].number();
    const double across = mass_kg * (3.0 * r * r + h * h) / 12.0;
    return diagonal(across, across, 0.5 * mass_kg * r * r);
  }
  if (kind == "sphere") {
    const double r = value["radius"].number();
    const double moment = 0.4 * mass_kg * r * r;
    return diagonal(moment, moment, moment);
  }
  const glm::dvec3 moments = vector_of(value);
  return diagonal(moments.x, moments.y, moments.z);
}

std::optional<RigidBodyOptions> read_body(const Value& value, config::Diagnostics& diagnostics) {
  const Value& name = value["body"];
  RigidBodyOptions body{.name = name.text(), .place = name.place(), .properties = {}};
  const bool has_mass = value.has("mass"), has_inertia = value.has("inertia");
  if (has_mass != has_inertia) {
    diagnostics.add(value.place(), "'" + body.name + "' has " + (has_mass ? "a mass" : "an inertia") +
                                       " but no '" + (has_mass ? "inertia" : "mass") +
                                       "'; a body that moves has both, a fixed body none");
    return std::nullopt;
  }
  if (!has_mass) return body;
  const double mass_kg = value["mass"].number();
  body.properties = {.mass_kg = mass_kg, .inertia_kgm2 = inertia_of(value["inertia"], mass_kg)};
  const std::string fault = fault_of_inertia(body.properties->inertia_kgm2);
  if (fault.empty()) return body;
  diagnostics.add(value["inertia"].place(), "'inertia': " + fault);
  return std::nullopt;
}

/// The two bodies of the pair with the least mass, and that mass.
struct LightestPair {
  const RigidBodyOptions* first = nullptr;
  const RigidBodyOptions* second = nullptr;  ///< null: a fixed body
  double mass_kg = 0.0;
};

LightestPair lightest_pair(const RigidBodiesOptions& options) {
  std::vector<const RigidBodyOptions*> moving;
  for (const RigidBodyOptions& body : options.bodies)
    if (body.properties) moving.push_back(&body);
  const auto mass = [](const RigidBodyOptions* body) { return body->properties->mass_kg; };
  std::stable_sort(moving.begin(), moving.end(),
                   [&](const auto* a, const auto* b) { return mass(a) < mass(b); });
  if (moving.size() < 2) return {moving[0], nullptr, mass(moving[0])};
  const double first = mass(moving[0]), second = mass(moving[1]);
  return {moving[0], moving[1], first * second / (first + second)};
}

std::string name_of(const LightestPair& pair) {
  const std::string mass = config::format_number(pair.mass_kg) + " kg";
  if (pair.second == nullptr) return "'" + pair.first->name + "' (" + mass + ")";
  return "'" + pair.first->name + "' and '" + pair.second->name + "' (reduced mass " + mass + ")";
}

Schema body_schema() {
  const auto length = Schema::quantity(Quantity::length_m, 1e-6, rtstdb::max_coordinate_m);
  const auto moment = Schema::quantity(Quantity::inertia_kgm2, 1e-12, 1e15);
  const auto inertia = Schema::exactly_one(
      {Field::optional("box", Schema::list(length, 3, 3), "Of a homogeneous box with these edge lengths."),
       Field::optional("cylinder",
                       Schema::record({Field::needed("radius", length, "The radius."),
                                       Field::needed("height", length, "Along the body's z axis.")}),
                       "Of a homogeneous cylinder."),
       Field::optional("sphere", Schema::record({Field::needed("radius", length, "The radius.")}),
                       "Of a homogeneous sphere."),
       Field::optional("moments", Schema::list(moment, 3, 3),
                       "The principal moments about the body's x, y and z axes.")});
  return Schema::record({
      Field::needed("body", Schema::text(),
                    "The entity. The origin of its shape is its centre of mass; it has its pose and "
                    "velocities at the start. Its shape is closed, or has a 'solid' or 'convex_parts'."),
      Field::optional("mass", Schema::quantity(Quantity::mass_kg, 1e-6, 1e9),
                      "The mass. A body without one is fixed: it stays where its row says, or moves as "
                      "another module moves it."),
      Field::optional("inertia", inertia, "The moments of inertia about the centre of mass."),
  });
}

}  // namespace

Schema rigid_bodies_schema() {
  const auto acceleration = Schema::quantity(Quantity::acceleration_mps2, -1e4, 1e4);
  return Schema::record({
      Field::needed("bodies", Schema::list(body_schema(), 1, max_rigid_bodies),
                    "The bodies that may touch. Contacts with other entities are not considered."),
      Field::with_default("gravity", Schema::list(acceleration, 3, 3), "[0 m/s2, 0 m/s2, -9.80665 m/s2]",
                          "The acceleration of all bodies with a mass, along the world's axes."),
      Field::with_default("mean_motion", Schema::quantity(Quantity::angular_rate_radps, -1.0, 1.0), "0 rad/s",
                          "The angular rate of the orbit, as of a free_body."),
      Field::needed("stiffness", Schema::quantity(Quantity::stiffness_npm, 1e-6, 1e15),
                    "The normal force of a pair per depth, and the force of its friction springs per "
                    "stretch. At most 0.1 m / h^2, with h the substep and m the reduced mass of the lightest "
                    "two bodies, or the mass of the only body that has one."),
      Field::needed("damping", Schema::quantity(Quantity::damping_nspm, 0.0, 1e15),
                    "The normal force of a pair per approach speed. At most 0.2 m / h."),
      Field::with_default("friction", Schema::number(0.0, 10.0), "0.5", "The coefficient of friction."),
      Field::with_default("margin", Schema::quantity(Quantity::length_m, 0.0, rtstdb::max_contact_margin_m),
                          "10 mm",
                          "Bodies nearer than this are watched for contact between two steps. At least the "
                          "way that two bodies approach in a step."),
      Field::with_default("substeps", Schema::integer(1, 1000), "4",
                          "Integration steps in a step of the task, on the planes of one answer."),
      Field::with_default("max_pairs", Schema::integer(1, 4096), "256", "Pairs that an answer can list."),
      Field::with_default("position_error", Schema::quantity(Quantity::length_m, 1e-9, 1e3), "0.1 mm",
                          "The largest difference between the row's position and the body's, away from "
                          "contacts."),
      Field::with_default("angle_error", Schema::quantity(Quantity::angle_rad, 1e-9, 3.0), "0.1 mrad",
                          "The largest angle between the row's attitude and the body's, away from contacts."),
  });
}

std::optional<RigidBodiesOptions> read_rigid_bodies(const Value& parameters,
                                                    config::Diagnostics& diagnostics) {
  RigidBodiesOptions options{.bodies = {},
                             .gravity_mps2 = vector_of(parameters["gravity"]),
                             .orbit_radps = parameters["mean_motion"].number(),
                             .law = {.stiffness_npm = parameters["stiffness"].number(),
                                     .damping_nspm = parameters["damping"].number(),
                                     .friction = parameters["friction"].number()},
                             .margin_m = parameters["margin"].number(),
                             .substeps = static_cast<std::uint32_t>(parameters["substeps"].integer()),
                             .max_pairs = static_cast<std::uint32_t>(parameters["max_pairs"].integer()),
                             .permitted = {.position_m = parameters["position_error"].number(),
                                           .angle_rad = parameters["angle_error"].number()}};
  const std::size_t before = diagnostics.count();
  for (const Value& value : parameters["bodies"].items()) {
    const auto body = read_body(value, diagnostics);
    if (!body) continue;
    const auto is_same = [&](const RigidBodyOptions& other) { return other.name == body->name; };
    if (std::ranges::any_of(options.bodies, is_same))
      diagnostics.add(body->place, "'" + body->name + "' is in the list of bodies already");
    options.bodies.push_back(*body);
  }
  if (diagnostics.count() == before &&
      std::ranges::none_of(options.bodies, [](const auto& body) { return body.properties.has_value(); }))
    diagnostics.add(parameters["bodies"].place(), "none of the bodies has a mass, so none moves");
  if (diagnostics.count() != before) return std::nullopt;
  return options;
}

void check_contact_law(const RigidBodiesOptions& options, const Value& parameters, double substep_s,
                       config::Diagnostics& diagnostics) {
  const LightestPair pair = lightest_pair(options);
  const auto check = [&](const char* field, double value, double largest, const char* unit,
                         const char* limit) {
    // Values of a scenario are rounded.
    constexpr double rounding = 1e-9;
    if (value <= largest * (1.0 + rounding)) return;
    diagnostics.add(parameters[field].place(),
                    std::string("'") + field + "' is " + config::format_number(value) + " " + unit +
                        ", but with a substep of " + config::format_number(1e3 * substep_s) + " ms and " +
                        name_of(pair) + " at most " + config::format_number(largest) + " " + unit + " (" +
                        limit + ") is stable; use a smaller value, more substeps or a faster task");
  };
  check("stiffness", options.law.stiffness_npm, max_stiffness_share * pair.mass_kg / (substep_s * substep_s),
        "N/m", "0.1 m / h^2");
  check("damping", options.law.damping_nspm, max_damping_share * pair.mass_kg / substep_s, "N s/m",
        "0.2 m / h");
}

}  // namespace hil::modules
