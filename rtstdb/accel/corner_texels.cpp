#include "rtstdb/accel/corner_texels.hpp"

#include <array>
#include <cmath>

#include <rtstdb/srgb.hpp>

#include "rtstdb/geometry/corner_attributes.hpp"
#include "rtstdb/geometry/octahedron.hpp"
#include "shaders/shared/corner.h"

namespace rtstdb::accel {
namespace {

constexpr std::uint32_t white = 0xFFFFFFFFu;

std::uint32_t packed_normal(const glm::vec3& normal) {
  return packed_direction(glm::vec3(unit_or_zero(glm::dvec3(normal))));
}

std::uint32_t packed_color(const glm::vec3& linear) {
  std::uint32_t packed = 0xFF000000u;
  for (int i = 0; i < 3; ++i) {
    const double encoded = srgb_from_linear(static_cast<double>(linear[i]));
    packed |= static_cast<std::uint32_t>(std::lround(255.0 * encoded)) << 8 * i;
  }
  return packed;
}

}  // namespace

std::uint64_t corner_texel_count(const TriangleMesh& mesh, bool with_normals) noexcept {
  const bool has_any = (with_normals && !mesh.corner_normals.empty()) || !mesh.corner_colors.empty();
  return has_any ? std::uint64_t{shared::corner_texels} * mesh.triangles.size() : 0;
}

std::vector<glm::uvec4> corner_texels(const TriangleMesh& mesh, bool with_normals) {
  std::vector<glm::uvec4> texels;
  texels.reserve(corner_texel_count(mesh, with_normals));
  if (texels.capacity() == 0) return texels;
  with_normals = with_normals && !mesh.corner_normals.empty();
  for (std::size_t triangle = 0; triangle < mesh.triangles.size(); ++triangle) {
    std::array<std::uint32_t, 3> normals{shared::corner_normal_none, shared::corner_normal_none,
                                         shared::corner_normal_none};
    std::array<std::uint32_t, 3> colors{white, white, white};
    for (std::size_t i = 0; i < 3; ++i) {
      if (with_normals) normals[i] = packed_normal(mesh.corner_normals[triangle][i]);
      if (!mesh.corner_colors.empty()) colors[i] = packed_color(mesh.corner_colors[triangle][i]);
    }
    texels.emplace_back(normals[0], normals[1], normals[2], colors[0]);
    texels.emplace_back(colors[1], colors[2], 0u, 0u);
  }
  return texels;
}

}  // namespace rtstdb::accel
