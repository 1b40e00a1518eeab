#include "rtstdb/geometry/closed_mesh.hpp"

#include <array>
#include <bit>
#include <cstdint>

namespace rtstdb {
namespace {

using Place = std::array<std::uint32_t, 3>;

Place place_of(const glm::vec3& p) noexcept {
  // Adding zero makes one place of both zeros.
  return {std::bit_cast<std::uint32_t>(p.x + 0.0f), std::bit_cast<std::uint32_t>(p.y + 0.0f),
          std::bit_cast<std::uint32_t>(p.z + 0.0f)};
}

/// Finalizer of SplitMix64 (Steele, Lea and Flood 2014).
std::uint64_t mixed(std::uint64_t x) noexcept {
  x = (x ^ x >> 30) * 0xBF58476D1CE4E5B9u;
  x = (x ^ x >> 27) * 0x94D049BB133111EBu;
  return x ^ x >> 31;
}

std::uint64_t hash_of(const Place& a, const Place& b) noexcept {
  std::uint64_t hash = 0x9E3779B97F4A7C15u;
  hash = mixed(hash ^ (std::uint64_t{a[0]} << 32 | a[1]));
  hash = mixed(hash ^ (std::uint64_t{a[2]} << 32 | b[0]));
  return mixed(hash ^ (std::uint64_t{b[1]} << 32 | b[2]));
}

/// `place_of(corner)`: what tells the corner from others.
template <class PlaceOf>
bool is_balanced(std::span<const glm::uvec3> triangles, const PlaceOf& place_of) noexcept {
  std::uint64_t balance = 0;
  for (const glm::uvec3& triangle : triangles) {
    const Place corners[] = {place_of(triangle.x), place_of(triangle.y), place_of(triangle.z)};
    for (int i = 0; i < 3; ++i) {
      const Place& from = corners[i];
      const Place& to = corners[(i + 1) % 3];
      if (from < to) balance += hash_of(from, to);
      if (to < from) balance -= hash_of(to, from);
    }
  }
  return balance == 0;
}

}  // namespace

bool is_closed(const MeshView& mesh) noexcept {
  return is_balanced(mesh.triangles,
                     [&](std::uint32_t corner) { return place_of(mesh.positions_m[corner]); });
}

bool is_closed_anywhere(std::span<const glm::uvec3> triangles) noexcept {
  return is_balanced(triangles, [](std::uint32_t corner) { return Place{corner, 0, 0}; });
}

}  // namespace rtstdb
