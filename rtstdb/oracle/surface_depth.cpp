// The greatest depth of a surface in a body, by branch and bound.

#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <queue>
#include <vector>

#include "rtstdb/oracle/nearest_point.hpp"
#include "rtstdb/oracle/surface_pair.hpp"

namespace rtstdb::oracle {
namespace {

constexpr std::size_t max_pieces = 200'000;
constexpr double relative_accuracy = 0.002;

/// A part of a triangle of the surface.
struct Piece {
  SurfaceTriangle corners_m;
  std::uint32_t triangle = 0;
  std::uint32_t hint = 0;        ///< a triangle of the body that may be near
  bool is_known_inside = false;  ///< the whole piece
  double bound_m = 0.0;          ///< no point of it in the body is deeper

  bool operator<(const Piece& other) const noexcept { return bound_m < other.bound_m; }
};

/// A point in the body is at most as deep in it as in a box around it.
double depth_in_box_m(const SurfaceBox& box, const glm::dvec3& p_m) noexcept {
  const glm::dvec3 depth = glm::min(p_m - box.minimum_m, box.maximum_m - p_m);
  return std::min({depth.x, depth.y, depth.z});
}

class DepthSearch {
 public:
  DepthSearch(const SurfaceBody& body, double accuracy_m, double floor_m)
      : body_(body), accuracy_m_(accuracy_m), best_m_(floor_m) {}

  SurfaceDepth run(const SurfaceBody& surface) {
    for (std::uint32_t i = 0; i < surface.triangles().size(); ++i) {
      Piece piece{.corners_m = surface.triangles()[i], .triangle = i};
      // The depth in a box along each of its sides is linear, so that it is largest at a corner.
      glm::dvec3 from_minimum(0.0);
      glm::dvec3 from_maximum(0.0);
      for (const glm::dvec3& corner : piece.corners_m) {
        from_minimum = glm::max(from_minimum, corner - body_.box().minimum_m);
        from_maximum = glm::max(from_maximum, body_.box().maximum_m - corner);
      }
      const glm::dvec3 depth = glm::min(from_minimum, from_maximum);
      piece.bound_m = std::min({depth.x, depth.y, depth.z});
      push(piece);
    }
    std::size_t count = 0;
    while (!pieces_.empty() && is_open(pieces_.top().bound_m) && ++count < max_pieces) {
      const Piece piece = pieces_.top();
      pieces_.pop();
      divide(piece);
    }
    found_.max_m = std::max(best_m_, closed_m_);
    if (!pieces_.empty()) found_.max_m = std::max(found_.max_m, pieces_.top().bound_m);
    return found_;
  }

 private:
  bool is_open(double bound_m) const {
    return bound_m > best_m_ + std::max(accuracy_m_, relative_accuracy * best_m_);
  }

  void push(const Piece& piece) {
    if (is_open(piece.bound_m))
      pieces_.push(piece);
    else if (piece.bound_m > best_m_)
      closed_m_ = std::max(closed_m_, piece.bound_m);
  }

  /// Makes the point the best one if it is in the body and deeper than the best one so far.
  void offer(const glm::dvec3& p_m, const SurfacePoint& nearest, const Piece& piece) {
    if (nearest.distance_m <= best_m_) return;
    if (!piece.is_known_inside && !body_.is_inside(p_m)) return;
    best_m_ = nearest.distance_m;
    found_.min_m = best_m_;
    found_.p_m = p_m;
    found_.nearest_m = nearest.p_m;
    found_.triangle = piece.triangle;
    found_.nearest_triangle = nearest.triangle;
  }

  void divide(Piece piece) {
    const auto& c = piece.corners_m;
    const glm::dvec3 center_m = (c[0] + c[1] + c[2]) / 3.0;
    const double radius_m = std::max(
        {glm::distance(c[0], center_m), glm::distance(c[1], center_m), glm::distance(c[2], center_m)});
    const SurfacePoint nearest = body_.nearest(center_m, piece.hint);
    piece.hint = nearest.triangle;
    near_count_ = 0;
    tighten(piece, nearest);
    piece.bound_m = std::min({piece.bound_m, nearest.distance_m + radius_m,
                              std::max(0.0, depth_in_box_m(body_.box(), center_m) + radius_m)});
    if (!is_open(piece.bound_m)) return push(piece);
    const bool is_center_inside = piece.is_known_inside || body_.is_inside(center_m);
    if (!piece.is_known_inside && nearest.distance_m > radius_m * (1.0 + 1e-9)) {
      if (!is_center_inside) return;
      piece.is_known_inside = true;
    }
    if (is_center_inside) {
      offer(center_m, nearest, piece);
      offer_corners(piece);
    }
    if (!is_open(piece.bound_m)) return push(piece);
    // At the middle of the longest edge, so that pieces of slivers get shorter.
    std::size_t longest = 0;
    for (std::size_t i = 1; i < 3; ++i)
      if (glm::distance(c[i], c[(i + 1) % 3]) > glm::distance(c[longest], c[(longest + 1) % 3])) longest = i;
    const std::size_t next = (longest + 1) % 3;
    const glm::dvec3 middle_m = 0.5 * (c[longest] + c[next]);
    for (const std::size_t replaced : {longest, next}) {
      Piece child = piece;
      child.corners_m[replaced] = middle_m;
      push(child);
    }
  }

  /// Offers the corners of the piece that may be deeper than the best point, and tightens its bound.
  void offer_corners(Piece& piece) {
    for (const glm::dvec3& corner : piece.corners_m) {
      const glm::dvec3 on_nearest = nearest_on_triangle(body_.triangles()[piece.hint], corner).point;
      if (glm::distance(on_nearest, corner) <= best_m_) continue;
      const SurfacePoint at_corner = body_.nearest(corner, piece.hint);
      tighten(piece, at_corner);
      offer(corner, at_corner, piece);
    }
  }

  /// Reduces the bound by the distances of the piece's corners from the nearest triangle, alone and together
  /// with each of the earlier ones.
  void tighten(Piece& piece, const SurfacePoint& nearest) {
    for (std::size_t i = 0; i < near_count_; ++i)
      if (near_[i].triangle == nearest.triangle) return;
    NearTriangle& added = near_[near_count_];
    added.triangle = nearest.triangle;
    for (std::size_t k = 0; k < 3; ++k) {
      const glm::dvec3& corner = piece.corners_m[k];
      added.distances_m[k] =
          glm::distance(nearest_on_triangle(body_.triangles()[nearest.triangle], corner).point, corner);
    }
    for (std::size_t i = 0; i <= near_count_; ++i) {
      double bound_m = 0.0;
      for (std::size_t k = 0; k < 3; ++k)
        bound_m = std::max(bound_m, 0.5 * (near_[i].distances_m[k] + added.distances_m[k]));
      piece.bound_m = std::min(piece.bound_m, bound_m);
    }
    ++near_count_;
  }

  struct NearTriangle {
    std::uint32_t triangle = 0;
    std::array<double, 3> distances_m{};  ///< of the corners of the piece
  };

  const SurfaceBody& body_;
  double accuracy_m_;
  double best_m_;
  double closed_m_ = 0.0;  ///< the largest bound of a piece that was not divided
  SurfaceDepth found_;
  std::priority_queue<Piece> pieces_;
  std::array<NearTriangle, 4> near_{};
  std::size_t near_count_ = 0;
};

}  // namespace

SurfaceDepth surface_depth(const SurfaceBody& surface, const SurfaceBody& body, double accuracy_m,
                           double floor_m) {
  return DepthSearch(body, accuracy_m, floor_m).run(surface);
}

}  // namespace rtstdb::oracle
