#pragma once
// Which positions of a mesh coincide. Corners of triangles that share a point often have positions of their
// own, so edges and neighbours are compared by place and not by index.

#include <glm/ext/vector_float3.hpp>

#include <array>
#include <bit>
#include <cstdint>
#include <span>
#include <vector>

namespace rtstdb {

/// A position as a value that can be compared and sorted; 0.0 and -0.0 are equal.
using Place = std::array<std::uint32_t, 3>;

inline Place place_of(const glm::vec3& p) noexcept {
  // Adding zero makes -0.0 and 0.0 equal.
  return {std::bit_cast<std::uint32_t>(p.x + 0.0f), std::bit_cast<std::uint32_t>(p.y + 0.0f),
          std::bit_cast<std::uint32_t>(p.z + 0.0f)};
}

/// For each position, the lowest index of a position that coincides with it.
std::vector<std::uint32_t> first_at_place(std::span<const glm::vec3> positions_m);

}  // namespace rtstdb
