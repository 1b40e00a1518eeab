#include "rtstdb/geometry/octahedron.hpp"

#include <glm/common.hpp>
#include <glm/ext/vector_float2.hpp>
#include <glm/geometric.hpp>

#include <cmath>

#include <rtstdb/result.hpp>

namespace rtstdb {
namespace {

constexpr float largest_part = 32767.0f;

/// The lower half of the octahedron lies outside the square of the upper half.
glm::vec2 folded_outwards(const glm::vec2& p) noexcept {
  const glm::vec2 sides(p.x < 0.0f ? -1.0f : 1.0f, p.y < 0.0f ? -1.0f : 1.0f);
  return (1.0f - glm::abs(glm::vec2(p.y, p.x))) * sides;
}

std::uint32_t bits_of(float part) noexcept {
  const auto steps = static_cast<std::int32_t>(std::lround(part * largest_part));
  return static_cast<std::uint32_t>(steps) & 0xFFFFu;
}

float part_of(std::uint32_t bits) noexcept {
  return static_cast<float>(static_cast<std::int16_t>(bits & 0xFFFFu)) / largest_part;
}

}  // namespace

std::uint32_t packed_direction(const glm::vec3& direction) noexcept {
  const glm::vec3 size = glm::abs(direction);
  const float sum = size.x + size.y + size.z;
  RTSTDB_ASSERT(sum > 0.0f && std::isfinite(sum), "the direction is zero or not finite");
  const glm::vec3 on_octahedron = direction / sum;
  const glm::vec2 upper(on_octahedron.x, on_octahedron.y);
  const glm::vec2 place = on_octahedron.z < 0.0f ? folded_outwards(upper) : upper;
  return bits_of(place.x) | bits_of(place.y) << 16;
}

glm::vec3 unpacked_direction(std::uint32_t packed) noexcept {
  const glm::vec2 place(part_of(packed), part_of(packed >> 16));
  const float z = 1.0f - std::abs(place.x) - std::abs(place.y);
  const glm::vec2 upper = z < 0.0f ? folded_outwards(place) : place;
  return glm::normalize(glm::vec3(upper, z));
}

}  // namespace rtstdb
