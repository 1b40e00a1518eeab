#pragma once
// The relations of bodies that expressions of a scenario read, as distance(ego, runner), for the module that
// computes them. Each is an output of it, in their order, with the name relation_name().
//
// Units: metres, radians. Frame: that of the carrier, or the world's. Threads: plain data, pure functions.

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <hil/diagnostics.hpp>

namespace hil::config {

/// A box in space, for inside(body, region) and crossed_at(body, region) of expressions.
struct WorldRegion {
  Word name;
  std::array<double, 3> center_m{};
  std::array<double, 3> size_m{};  ///< before the rotation
  double heading_rad = 0.0;        ///< about z
  bool whole = false;              ///< all of the body has to be in it, not a part
  std::optional<Word> carrier;     ///< the body in whose frame it is
};

/// A straight line from a point, for sees(beam, body) of expressions.
struct WorldBeam {
  Word name;
  std::array<double, 3> origin_m{};
  double azimuth_rad = 0.0, elevation_rad = 0.0, range_m = 0.0;
  std::optional<Word> carrier;  ///< the body in whose frame it is
};

}  // namespace hil::config

namespace hil::expression {

enum class RelationKind : unsigned char { distance, contact, time_to_impact, inside, crossed_at, sees };

struct RelationFunction {
  RelationKind kind{};
  std::string_view name;
  std::string_view unit;       ///< of the value; "": true or false
  std::string_view arguments;  ///< for documentation: "body, other"
  std::string_view about;
};

inline constexpr double max_impact_window_s = 10.0;

/// A relation that an expression reads.
struct Relation {
  const RelationFunction* function = nullptr;
  config::Word first{}, second{};         ///< the arguments that are names
  double window_s = max_impact_window_s;  ///< of time_to_impact: how far ahead impacts are searched
};

/// "distance(traffic.ego, rock)", "time_to_impact(a, b, 2 s)" with a window other than the longest.
std::string relation_name(const Relation& relation);

}  // namespace hil::expression

namespace hil::modules {

/// Those that the expressions of a scenario read, and the regions and beams of its world.
struct Relations {
  std::vector<expression::Relation> all;
  std::vector<config::WorldRegion> regions;
  std::vector<config::WorldBeam> beams;
};

}  // namespace hil::modules
