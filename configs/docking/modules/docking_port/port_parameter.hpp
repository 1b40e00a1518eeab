#pragma once
// A parameter that is a docking port of a body: the name of the body, and where the port is in its frame.
// Several module types have one.

#include <glm/geometric.hpp>

#include <optional>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>
#include <hil/world/vector_parameter.hpp>

#include "configs/docking/modules/docking_port/port_geometry.hpp"

namespace hil::modules {

/// The keys body, position and axis.
inline std::vector<config::Field> port_fields() {
  using config::Field;
  using config::Quantity;
  using config::Schema;
  return {
      Field::needed("body", Schema::text(), "The body that has the port."),
      Field::with_default("position", Schema::list(Schema::quantity(Quantity::length_m, -1e4, 1e4), 3, 3),
                          "[0 m, 0 m, 0 m]", "The middle of the port, in the body's frame."),
      Field::with_default("axis", Schema::list(Schema::number(-1e3, 1e3), 3, 3), "[1, 0, 0]",
                          "The direction out of the port, in the body's frame; of any length."),
  };
}

/// `value` conforms to a schema with port_fields(). Empty with a mistake when the axis has no direction.
inline std::optional<BodyPort> read_port(const config::Value& value, config::Diagnostics& diagnostics) {
  const glm::dvec3 axis = vector_of(value["axis"]);
  const double length = glm::length(axis);
  constexpr double min_length = 1e-6;
  if (length < min_length) {
    diagnostics.add(value["axis"].place(),
                    "'axis' has no direction; one of its numbers has to differ from 0");
    return std::nullopt;
  }
  return BodyPort{.point_m = vector_of(value["position"]), .axis = axis / length};
}

}  // namespace hil::modules
