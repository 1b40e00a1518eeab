#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include <rtstdb/geometry.hpp>
#include <rtstdb/result.hpp>

namespace rtstdb {
namespace {

struct HullFace {
  std::array<std::uint32_t, 3> corners;
  glm::dvec3 normal;  // not of unit length
};

class Hull {
 public:
  explicit Hull(std::span<const glm::vec3> points_m) {
    for (const glm::vec3& p : points_m)
      points_.emplace_back(p);
    const std::array<std::uint32_t, 4> first = first_corners();
    for (std::size_t i = 0; i < 4; ++i)
      add({first[(i + 1) % 4], first[(i + 2) % 4], first[(i + 3) % 4]}, points_[first[i]]);
    for (std::uint32_t i = 0; i < points_.size(); ++i)
      extend_to(i);
  }

  TriangleMesh mesh() const {
    constexpr std::uint32_t unused = std::numeric_limits<std::uint32_t>::max();
    std::vector<std::uint32_t> index_of(points_.size(), unused);
    TriangleMesh mesh;
    for (const HullFace& face : faces_) {
      for (const std::uint32_t corner : face.corners) {
        if (index_of[corner] != unused) continue;
        index_of[corner] = static_cast<std::uint32_t>(mesh.positions_m.size());
        mesh.positions_m.emplace_back(points_[corner]);
      }
      mesh.triangles.emplace_back(index_of[face.corners[0]], index_of[face.corners[1]],
                                  index_of[face.corners[2]]);
    }
    return mesh;
  }

 private:
  double volume(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
    return glm::dot(glm::cross(points_[b] - points_[a], points_[c] - points_[a]), points_[d] - points_[a]);
  }

  /// The point for which the function is largest.
  template <class Of>
  std::uint32_t farthest(Of&& of) const {
    std::uint32_t best = 0;
    for (std::uint32_t i = 1; i < points_.size(); ++i)
      if (of(i) > of(best)) best = i;
    return best;
  }

  /// Four points that span a volume.
  std::array<std::uint32_t, 4> first_corners() const {
    RTSTDB_ASSERT(points_.size() >= 4);
    const std::uint32_t a = farthest([&](std::uint32_t i) { return points_[i].x; });
    const std::uint32_t b = farthest([&](std::uint32_t i) { return glm::distance(points_[i], points_[a]); });
    const std::uint32_t c = farthest([&](std::uint32_t i) {
      return glm::length(glm::cross(points_[i] - points_[a], points_[b] - points_[a]));
    });
    const std::uint32_t d = farthest([&](std::uint32_t i) { return std::abs(volume(a, b, c, i)); });
    RTSTDB_ASSERT(volume(a, b, c, d) != 0.0);
    return {a, b, c, d};
  }

  /// Adds a face whose back is toward the point.
  void add(std::array<std::uint32_t, 3> corners, const glm::dvec3& behind) {
    const auto normal = [&] {
      return glm::cross(points_[corners[1]] - points_[corners[0]], points_[corners[2]] - points_[corners[0]]);
    };
    if (glm::dot(normal(), behind - points_[corners[0]]) > 0.0) std::swap(corners[1], corners[2]);
    faces_.push_back({corners, normal()});
  }

  void extend_to(std::uint32_t point) {
    const auto hidden_end = std::partition(faces_.begin(), faces_.end(), [&](const HullFace& face) {
      return std::ranges::find(face.corners, point) != face.corners.end() ||
             glm::dot(face.normal, points_[point] - points_[face.corners[0]]) <= 0.0;
    });
    // The rim of the visible faces: their edges whose reverse is of no visible face.
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (auto face = hidden_end; face != faces_.end(); ++face)
      for (std::size_t i = 0; i < 3; ++i)
        edges.emplace_back(face->corners[i], face->corners[(i + 1) % 3]);
    faces_.erase(hidden_end, faces_.end());
    std::ranges::sort(edges);
    for (const auto& [from, to] : edges) {
      if (std::ranges::binary_search(edges, std::pair(to, from))) continue;
      faces_.push_back(
          {{from, to, point}, glm::cross(points_[to] - points_[from], points_[point] - points_[from])});
    }
  }

  std::vector<glm::dvec3> points_;
  std::vector<HullFace> faces_;
};

}  // namespace

TriangleMesh make_hull(std::span<const glm::vec3> points_m) {
  return Hull(points_m).mesh();
}

}  // namespace rtstdb
