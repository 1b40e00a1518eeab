#include "rtstdb/accel/hull_texels.hpp"

#include <glm/geometric.hpp>
#include <glm/vec3.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>

#include "shaders/shared/contact.h"

namespace rtstdb::accel {
namespace {

glm::vec4 texel(const glm::vec3& xyz, std::uint32_t word = 0) {
  return {xyz, std::bit_cast<float>(word)};
}

glm::vec4 texel(std::uint32_t x, std::uint32_t y, std::uint32_t z, std::uint32_t w) {
  return {std::bit_cast<float>(x), std::bit_cast<float>(y), std::bit_cast<float>(z), std::bit_cast<float>(w)};
}

/// Repeats the last corner until their number is a multiple of what the device reads at a time.
void fill_up(std::vector<glm::vec3>& corners_m) {
  while (corners_m.size() % shared::hull_corners_per_step != 0)
    corners_m.push_back(corners_m.back());
}

/// The tree over the corners of a large hull.
class CornerTree {
 public:
  explicit CornerTree(std::vector<glm::vec3> all_m) { build(all_m); }
  std::vector<glm::vec3> corners_m;  ///< in the order of the leaves
  std::vector<glm::vec4> texels;     ///< of the nodes

 private:
  /// Along the longest axis one half of the corners becomes the left child, the other the right one.
  void build(std::span<glm::vec3> part_m) {
    glm::vec3 minimum(std::numeric_limits<float>::infinity());
    glm::vec3 maximum = -minimum;
    for (const glm::vec3& p : part_m) {
      minimum = glm::min(minimum, p);
      maximum = glm::max(maximum, p);
    }
    const glm::vec3 center(0.5 * (glm::dvec3(minimum) + glm::dvec3(maximum)));
    double radius = 0.0;
    for (const glm::vec3& p : part_m)
      radius = std::max(radius, glm::distance(glm::dvec3(p), glm::dvec3(center)));
    const std::size_t node = texels.size();
    texels.emplace_back(center,
                        static_cast<float>(radius) * (1.0f + 4.0f * std::numeric_limits<float>::epsilon()));
    texels.emplace_back(0.0f);
    const auto first = static_cast<std::uint32_t>(corners_m.size());
    std::uint32_t count = 0;
    if (part_m.size() <= shared::hull_corners_per_leaf) {
      corners_m.insert(corners_m.end(), part_m.begin(), part_m.end());
      fill_up(corners_m);
      count = static_cast<std::uint32_t>(corners_m.size()) - first;
    } else {
      const glm::vec3 extent = maximum - minimum;
      const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
      const std::size_t half = part_m.size() / 2;
      std::ranges::nth_element(part_m, part_m.begin() + static_cast<std::ptrdiff_t>(half), {},
                               [&](const glm::vec3& p) { return p[axis]; });
      build(part_m.first(half));
      build(part_m.subspan(half));
    }
    const auto behind = static_cast<std::uint32_t>(texels.size()) / shared::hull_node_texels;
    texels[node + 1] = texel(behind, first, count, 0);
  }
};

}  // namespace

std::vector<glm::vec4> hull_texels(const ConvexHull& hull) {
  const std::size_t supporting = hull.round ? hull.round->core_corners : hull.corners_m.size();
  std::vector<glm::vec3> corners(hull.corners_m.begin(),
                                 hull.corners_m.begin() + static_cast<std::ptrdiff_t>(supporting));
  std::vector<glm::vec4> nodes;
  if (corners.size() > shared::hull_max_scanned_corners) {
    CornerTree tree(std::move(corners));
    corners = std::move(tree.corners_m);
    nodes = std::move(tree.texels);
  } else {
    fill_up(corners);
  }
  const auto corner_count = static_cast<std::uint32_t>(corners.size());
  const auto node_texels = static_cast<std::uint32_t>(nodes.size());
  const auto face_count = static_cast<std::uint32_t>(hull.faces.size());
  const std::uint32_t face_texel = shared::hull_header_texels + corner_count + node_texels;

  std::vector<glm::vec4> texels{
      texel(hull.center_m, corner_count),
      texel(face_count, node_texels / shared::hull_node_texels, face_texel, face_texel + face_count),
      hull.round ? glm::vec4(hull.round->axis, hull.round->radius_m) : glm::vec4(0.0f)};
  for (const glm::vec3& corner : corners)
    texels.push_back(texel(corner));
  texels.insert(texels.end(), nodes.begin(), nodes.end());
  std::vector<glm::vec4> polygons;
  for (const ConvexHull::Face& face : hull.faces) {
    const std::uint32_t used = std::min(face.corner_count, shared::hull_max_polygon_corners);
    texels.push_back(texel(face.normal, static_cast<std::uint32_t>(polygons.size()) | used << 24));
    for (std::uint32_t i = 0; i < used; ++i) {
      const std::uint32_t corner =
          hull.face_corners[face.first_corner + std::uint64_t{i} * face.corner_count / used];
      polygons.push_back(texel(hull.corners_m[corner]));
    }
  }
  texels.insert(texels.end(), polygons.begin(), polygons.end());
  return texels;
}

}  // namespace rtstdb::accel
