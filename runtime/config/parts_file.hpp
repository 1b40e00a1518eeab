#pragma once
// A file that makes one shape of parts: {parts: [{cylinder: {...}, position: ..., rotation: ..., repeat:
// ...}]}. A part is a simple body at a place in the frame of the shape, with copies.
//
// SI units. Threads: plain data.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

namespace hil::config {

// Bodies are centred on the origin; their axes are along z. The corners of round bodies lie on the round
// surface.

/// Full extents along x, y and z.
struct BoxPart {
  std::array<double, 3> size_m{};
};
struct ConePart {
  double radius_m = 0.0;      ///< at the lower end
  double top_radius_m = 0.0;  ///< at the upper end; equal for a cylinder, 0 for a cone with a tip
  double height_m = 0.0;
  std::uint32_t segments = 0;
};
struct SpherePart {
  double radius_m = 0.0;
  std::uint32_t subdivisions = 0;
};
/// A torus about z.
struct RingPart {
  double radius_m = 0.0;       ///< of the circle in the middle of the tube
  double tube_radius_m = 0.0;  ///< smaller than radius_m
  std::uint32_t segments = 0;  ///< around the axis
  std::uint32_t sides = 0;     ///< of the tube
};
using PartBody = std::variant<BoxPart, ConePart, SpherePart, RingPart>;

/// `count` copies: the first is at the place of the part; each of the others is moved from the previous one.
struct PartRepeat {
  std::uint32_t count = 1;
  std::array<double, 3> step_m{};  ///< in the frame of the shape
  double turn_rad = 0.0;           ///< about an axis of that frame, before the step
  std::size_t axis = 2;            ///< 0: x, 1: y, 2: z
};

struct Part {
  PartBody body;
  std::array<double, 3> position_m{};
  std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};  ///< of the part to the shape; unit quaternion
  std::array<double, 3> color{1.0, 1.0, 1.0};               ///< times the material's base colour; linear
  std::vector<PartRepeat> repeat;  ///< the first one repeats the part, the next one all copies of it, ...
};

/// More triangles than any world holds.
inline constexpr std::uint64_t max_counted_triangles = std::uint64_t{1} << 40;

/// The number of triangles of a part with all its copies. The count stops at max_counted_triangles.
std::uint64_t triangles_of(const Part& part) noexcept;

Schema parts_file_schema();

/// The parts of a file; empty if it has mistakes. More than `max_triangles` triangles in all are a mistake.
std::optional<std::vector<Part>> load_parts(const std::string& path, std::uint64_t max_triangles,
                                            Diagnostics& diagnostics);

}  // namespace hil::config
