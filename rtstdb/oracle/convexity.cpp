// Whether a mesh is convex, by supports along directions: no hull is built.
//
// The depth of a point below the surface of the hull of some corners is the least value, over all unit
// directions, of the hull's support along the direction minus the point's coordinate. It is attained at the
// normal of a face of the hull, hence at the normal of a plane through three corners.

#include <glm/common.hpp>
#include <glm/ext/vector_double2.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <tuple>
#include <vector>

#include <rtstdb/limits.hpp>

#include "rtstdb/geometry/ulp.hpp"
#include "rtstdb/oracle/mesh_tree.hpp"
#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {
namespace {

/// Meshes of up to this number of corners are decided with the planes through any three corners. Of a larger
/// one, a triangle counts as near the surface only if it is so along the normal of a triangle of the mesh.
constexpr std::size_t max_exact_corners = 24;

using Triangle = std::array<glm::dvec3, 3>;

/// A direction with the support of the corners along it.
struct Support {
  glm::dvec3 direction;
  double reach_m;
};

/// How far the lowest corner of a triangle is below the support.
double lowest_m(const Support& support, const Triangle& triangle) {
  double max_m = -std::numeric_limits<double>::infinity();
  for (const glm::dvec3& p : triangle)
    max_m = std::max(max_m, support.reach_m - glm::dot(support.direction, p));
  return max_m;
}

class ConvexityTest {
 public:
  explicit ConvexityTest(const MeshTree& mesh) {
    origin_m_ = mesh.corners(0)[0];
    std::set<std::tuple<double, double, double>> places;
    double largest_m = 0.0;
    glm::dvec3 minimum(std::numeric_limits<double>::infinity()), maximum = -minimum;
    for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      Triangle triangle = mesh.corners(t);
      for (glm::dvec3& p : triangle) {
        largest_m = std::max({largest_m, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
        minimum = glm::min(minimum, p);
        maximum = glm::max(maximum, p);
        p -= origin_m_;
        if (places.emplace(p.x, p.y, p.z).second) corners_m_.push_back(p);
      }
      if (glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]) != glm::dvec3(0.0))
        triangles_m_.push_back(triangle);
    }
    thin_m_ = hull_tolerance_ulp * ulp_m(largest_m);
    allowed_m_ = std::max(convex_tolerance * glm::length(maximum - minimum), thin_m_);
  }

  bool passes(const MeshTree& mesh) {
    if (triangles_m_.empty()) return false;
    if (corners_m_.size() <= max_exact_corners) {
      add_planes_of_corners();
      for (const Support& support : supports_)
        normals_.push_back(support.direction);
      const bool is_flat = supports_.empty() || thin_direction(mesh, thin_m_).has_value();
      for (const Triangle& triangle : triangles_m_)
        if (!is_flat && !is_near_surface(triangle, 0)) return false;
    } else if (!are_near_along_normals(mesh)) {
      return false;
    }
    // The middle of the corners may be outside a thin body whose surface is dented.
    const auto thin = thin_direction(mesh, 16.0 * allowed_m_);
    return thin ? covers_plane(*thin) : std::abs(turns_around_middle()) > 0.5;
  }

 private:
  double reach_m(const glm::dvec3& direction) const {
    double max_m = -std::numeric_limits<double>::infinity();
    for (const glm::dvec3& p : corners_m_)
      max_m = std::max(max_m, glm::dot(direction, p));
    return max_m;
  }

  void add_support(const glm::dvec3& across) {
    const double length = glm::length(across);
    if (length == 0.0) return;
    for (const double side : {1.0, -1.0})
      supports_.push_back({side / length * across, reach_m(side / length * across)});
  }

  void add_planes_of_corners() {
    for (std::size_t i = 2; i < corners_m_.size(); ++i)
      for (std::size_t k = 1; k < i; ++k)
        for (std::size_t j = 0; j < k; ++j)
          add_support(glm::cross(corners_m_[k] - corners_m_[j], corners_m_[i] - corners_m_[j]));
  }

  /// For many corners: whether each triangle is near the surface along its own normal or that of another.
  bool are_near_along_normals(const MeshTree& mesh) {
    const auto is_near = [&](const Triangle& triangle, const glm::dvec3& direction) {
      const auto along = [&](const glm::dvec3& p) { return glm::dot(direction, p); };
      const glm::dvec3 lowest_m = *std::ranges::min_element(triangle, {}, along);
      return !mesh.has_corner_beyond(lowest_m + origin_m_, direction, allowed_m_);
    };
    std::vector<const Triangle*> undecided;
    for (const Triangle& triangle : triangles_m_) {
      const glm::dvec3 normal =
          glm::normalize(glm::cross(triangle[1] - triangle[0], triangle[2] - triangle[0]));
      normals_.insert(normals_.end(), {normal, -normal});
      if (!is_near(triangle, normal) && !is_near(triangle, -normal)) undecided.push_back(&triangle);
      if (undecided.size() > 8 + triangles_m_.size() / 4) return false;
    }
    return std::ranges::all_of(undecided, [&](const Triangle* triangle) {
      return std::ranges::any_of(normals_,
                                 [&](const glm::dvec3& direction) { return is_near(*triangle, direction); });
    });
  }

  /// Whether the body is thinner than the limit along one of the directions, which is then the result.
  std::optional<glm::dvec3> thin_direction(const MeshTree& mesh, double limit_m) const {
    for (const glm::dvec3& normal : normals_) {
      if (mesh.has_corner_beyond(origin_m_, -normal, limit_m)) continue;
      const auto along = [&](const glm::dvec3& p) { return glm::dot(normal, p); };
      const glm::dvec3& farthest = *std::ranges::max_element(corners_m_, {}, along);
      if (!mesh.has_corner_beyond(farthest + origin_m_, -normal, limit_m)) return normal;
    }
    return std::nullopt;
  }

  /// One direction suffices for a triangle that is flat beside the surface; others are divided.
  bool is_near_surface(const Triangle& triangle, int depth) const {
    const glm::dvec3 center = (triangle[0] + triangle[1] + triangle[2]) / 3.0;
    double center_m = std::numeric_limits<double>::infinity();
    for (const Support& support : supports_) {
      if (lowest_m(support, triangle) <= allowed_m_) return true;
      center_m = std::min(center_m, support.reach_m - glm::dot(support.direction, center));
    }
    if (center_m > allowed_m_ || depth == 10) return center_m <= allowed_m_;
    const auto& [a, b, c] = triangle;
    const glm::dvec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
    return is_near_surface({ab, bc, ca}, depth + 1) && is_near_surface({a, ab, ca}, depth + 1) &&
           is_near_surface({b, bc, ab}, depth + 1) && is_near_surface({c, ca, bc}, depth + 1);
  }

  /// The winding number of the mesh around the mean of its corners, by solid angles (Van Oosterom, Strackee,
  /// "The Solid Angle of a Plane Triangle", 1983).
  double turns_around_middle() const {
    glm::dvec3 middle(0.0);
    for (const glm::dvec3& p : corners_m_)
      middle += p / static_cast<double>(corners_m_.size());
    double angle = 0.0;
    for (const Triangle& triangle : triangles_m_) {
      const glm::dvec3 a = triangle[0] - middle, b = triangle[1] - middle, c = triangle[2] - middle;
      const double la = glm::length(a), lb = glm::length(b), lc = glm::length(c);
      angle += 2.0 * std::atan2(glm::dot(a, glm::cross(b, c)), la * lb * lc + glm::dot(a, b) * lc +
                                                                   glm::dot(b, c) * la + glm::dot(c, a) * lb);
    }
    return angle / (4.0 * std::numbers::pi);
  }

  /// Whether the triangles, seen along the normal, leave no hole and no notch: beside each edge, inside the
  /// polygon of all corners, there is a triangle.
  bool covers_plane(const glm::dvec3& normal) const {
    const glm::dvec3 u = glm::normalize(
        glm::cross(normal, std::abs(normal.x) < 0.5 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0)));
    const glm::dvec3 v = glm::cross(normal, u);
    const auto seen = [&](const glm::dvec3& p) { return glm::dvec2(glm::dot(u, p), glm::dot(v, p)); };
    std::vector<std::array<glm::dvec2, 3>> triangles;
    std::vector<std::array<glm::dvec2, 2>> sides;  // a direction outward, and (reach, 0)
    for (const Triangle& triangle : triangles_m_) {
      triangles.push_back({seen(triangle[0]), seen(triangle[1]), seen(triangle[2])});
      for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec2 along = triangles.back()[(i + 1) % 3] - triangles.back()[i];
        if (along == glm::dvec2(0.0)) continue;
        for (const double side : {1.0, -1.0}) {
          const glm::dvec2 out = side * glm::normalize(glm::dvec2(along.y, -along.x));
          double reach_m = -std::numeric_limits<double>::infinity();
          for (const glm::dvec3& p : corners_m_)
            reach_m = std::max(reach_m, glm::dot(out, seen(p)));
          sides.push_back({out, glm::dvec2(reach_m, 0.0)});
        }
      }
    }
    const auto is_inside = [&](const glm::dvec2& p) {
      return std::ranges::all_of(
          sides, [&](const auto& side) { return glm::dot(side[0], p) < side[1].x - 4.0 * allowed_m_; });
    };
    const auto is_covered = [&](const glm::dvec2& p) {
      return std::ranges::any_of(triangles, [&](const auto& t) {
        const auto turn = [&](std::size_t i) {
          const glm::dvec2 a = t[i], along = t[(i + 1) % 3] - a;
          return along.x * (p.y - a.y) - along.y * (p.x - a.x);
        };
        const double d0 = turn(0), d1 = turn(1), d2 = turn(2);
        return (d0 >= 0.0 && d1 >= 0.0 && d2 >= 0.0) || (d0 <= 0.0 && d1 <= 0.0 && d2 <= 0.0);
      });
    };
    for (const auto& t : triangles) {
      for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec2 along = t[(i + 1) % 3] - t[i];
        if (along == glm::dvec2(0.0)) continue;
        const glm::dvec2 out = 8.0 * allowed_m_ * glm::normalize(glm::dvec2(along.y, -along.x));
        for (const glm::dvec2& beside : {t[i] + 0.5 * along + out, t[i] + 0.5 * along - out})
          if (is_inside(beside) && !is_covered(beside)) return false;
      }
    }
    return true;
  }

  std::vector<glm::dvec3> corners_m_;  // distinct; relative to the first one
  std::vector<Triangle> triangles_m_;  // with an area
  std::vector<Support> supports_;
  std::vector<glm::dvec3> normals_;  // unit; where the body may be thin
  glm::dvec3 origin_m_{0.0};
  double thin_m_ = 0.0, allowed_m_ = 0.0;
};

}  // namespace

bool MeshTree::is_convex_surface() const {
  return closed_ && ConvexityTest(*this).passes(*this);
}

bool is_convex(const TriangleMesh& mesh) {
  return MeshTree(mesh).convex();
}

}  // namespace rtstdb::oracle
