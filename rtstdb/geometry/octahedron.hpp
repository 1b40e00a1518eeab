#pragma once
// A direction in 32 bits: a point of an octahedron whose lower half is folded outwards (Meyer et al. 2010,
// "On Floating-Point Normal Vectors"), two signed 16-bit coordinates, x in the low half. The error of the
// direction is below 1e-4 rad. Mirrored by shaders/common/octahedron.glsl. Pure functions; any thread.

#include <glm/ext/vector_float3.hpp>

#include <cstdint>

namespace rtstdb {

/// Of any length. Neither half of the result is 0x8000. Misuse: a vector without length, or so long that the
/// sum of its coordinates is infinite.
std::uint32_t packed_direction(const glm::vec3& direction) noexcept;
/// A unit vector.
glm::vec3 unpacked_direction(std::uint32_t packed) noexcept;

}  // namespace rtstdb
