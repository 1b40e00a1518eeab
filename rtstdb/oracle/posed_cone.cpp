#include "rtstdb/oracle/posed_cone.hpp"

#include <glm/ext/vector_double2.hpp>
#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace rtstdb::oracle {
namespace {

double cross(const glm::dvec2& p, const glm::dvec2& q) noexcept {
  return p.x * q.y - p.y * q.x;
}

/// The point of the segment that is nearest to the axis.
glm::dvec3 nearest_to_axis(const glm::dvec3& a, const glm::dvec3& b) noexcept {
  const glm::dvec2 from(a);
  const glm::dvec2 edge = glm::dvec2(b) - from;
  const double square = glm::dot(edge, edge);
  const double along = square > 0.0 ? std::clamp(-glm::dot(from, edge) / square, 0.0, 1.0) : 0.0;
  return a + along * (b - a);
}

double from_axis(const glm::dvec3& p) noexcept {
  return glm::length(glm::dvec2(p));
}

/// Whether the axis meets the triangle's projection along the axis.
bool surrounds_axis(const ConeCorners& c) noexcept {
  const double a = cross(glm::dvec2(c[0]), glm::dvec2(c[1]));
  const double b = cross(glm::dvec2(c[1]), glm::dvec2(c[2]));
  const double d = cross(glm::dvec2(c[2]), glm::dvec2(c[0]));
  return (a >= 0.0 && b >= 0.0 && d >= 0.0) || (a <= 0.0 && b <= 0.0 && d <= 0.0);
}

/// The point of the triangle's projection along the axis that is nearest to it.
glm::dvec3 nearest_seen_along_axis(const ConeCorners& c) noexcept {
  const double area = cross(glm::dvec2(c[1] - c[0]), glm::dvec2(c[2] - c[0]));
  if (area != 0.0 && surrounds_axis(c)) {
    const double u = cross(glm::dvec2(c[2]), glm::dvec2(c[0])) / area;
    const double v = cross(glm::dvec2(c[0]), glm::dvec2(c[1])) / area;
    return c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
  }
  const std::array points{nearest_to_axis(c[0], c[1]), nearest_to_axis(c[1], c[2]),
                          nearest_to_axis(c[2], c[0])};
  return *std::ranges::min_element(points, {}, from_axis);
}

/// The point of the triangle at height z that is nearest to the axis. The triangle is not perpendicular to
/// the axis, and z is between the heights of its corners.
glm::dvec3 nearest_at(const ConeCorners& c, double z) noexcept {
  std::array<glm::dvec3, 6> points{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3& p = c[i];
    const glm::dvec3& q = c[(i + 1) % 3];
    if (z < std::min(p.z, q.z) || z > std::max(p.z, q.z)) continue;
    if (p.z == q.z) {
      points[count++] = p;
      points[count++] = q;
      continue;
    }
    const double t = (z - p.z) / (q.z - p.z);
    points[count++] = (1.0 - t) * p + t * q;
  }
  glm::dvec3 best = points[0];
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t k = 0; k < i; ++k) {
      const glm::dvec3 point = nearest_to_axis(points[i], points[k]);
      if (from_axis(point) < from_axis(best)) best = point;
    }
  }
  return best;
}

}  // namespace

// The distance from the axis at height z, minus the radius there, is a convex function of z: the least value
// of a convex function over the slices of a convex body. So the heights at which the triangle is in the space
// are an interval.
std::optional<glm::dvec3> first_point(const ConeCorners& c, const ConeSpace& space) noexcept {
  const auto [least, most] = std::minmax({c[0].z, c[1].z, c[2].z});
  double first = std::max(least, space.z_min_m);
  double last = std::min(most, space.z_max_m);
  if (first > last) return std::nullopt;
  const glm::dvec3 beside = nearest_seen_along_axis(c);
  if (from_axis(beside) > space.slope * std::max(last, 0.0) + space.margin_m) return std::nullopt;
  const double flatness = 1e-13 * (std::abs(least) + std::abs(most));
  if (most - least <= flatness) {
    const bool inside = from_axis(beside) <= space.slope * most + space.margin_m;
    return inside ? std::optional(beside) : std::nullopt;
  }
  const auto outside = [&](double z) {
    return from_axis(nearest_at(c, z)) - space.slope * z - space.margin_m;
  };
  if (outside(first) <= 0.0) return nearest_at(c, first);
  // Golden section, until a height inside is found.
  constexpr double golden = 0.6180339887498949;
  double low = first;
  double high = last;
  double inside = std::numeric_limits<double>::quiet_NaN();
  if (outside(last) <= 0.0) inside = last;
  double a = high - golden * (high - low);
  double b = low + golden * (high - low);
  double at_a = outside(a);
  double at_b = outside(b);
  for (int i = 0; i < 100 && std::isnan(inside); ++i) {
    if (at_a <= 0.0) {
      inside = a;
    } else if (at_b <= 0.0) {
      inside = b;
    } else if (at_a < at_b) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - golden * (high - low);
      at_a = outside(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + golden * (high - low);
      at_b = outside(b);
    }
  }
  if (std::isnan(inside)) return std::nullopt;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (first + inside);
    (outside(middle) <= 0.0 ? inside : first) = middle;
  }
  return nearest_at(c, inside);
}

Ray axis_of(const Cone& cone) noexcept {
  Ray ray;
  ray.origin_m = cone.origin_m;
  ray.direction = cone.direction;
  ray.lambda_max = cone.lambda_max;
  ray.t = cone.t;
  ray.mask = cone.mask;
  ray.carrier = cone.carrier;
  return ray;
}

PosedCone::PosedCone(const World& world, const Cone& cone)
    : axis(world, axis_of(cone), false),
      z(axis.direction / axis.length),
      half_angle_rad(0.5 * static_cast<double>(cone.opening_angle_rad)) {
  const glm::dvec3 across = std::abs(z.x) < 0.5 ? glm::dvec3(1.0, 0.0, 0.0) : glm::dvec3(0.0, 1.0, 0.0);
  x = glm::normalize(glm::cross(across, z));
  y = glm::cross(z, x);
}

double PosedCone::slope() const noexcept {
  return std::tan(half_angle_rad);
}

glm::dvec3 PosedCone::in_cone(const glm::dvec3& p_world_m) const noexcept {
  const glm::dvec3 from_apex = p_world_m - axis.origin_m;
  return {glm::dot(from_apex, x), glm::dot(from_apex, y), glm::dot(from_apex, z)};
}

glm::dvec3 PosedCone::in_world(const glm::dvec3& p) const noexcept {
  return axis.origin_m + p.x * x + p.y * y + p.z * z;
}

ConeCorners PosedCone::corners(const PosedEntity& entity, std::uint32_t triangle) const noexcept {
  ConeCorners corners = entity.corners_world(triangle);
  for (glm::dvec3& corner : corners)
    corner = in_cone(corner);
  return corners;
}

ConeSpace PosedCone::space(double by_m) const noexcept {
  return {slope(), by_m / std::cos(half_angle_rad), -by_m, axis.lambda_max * axis.length + by_m};
}

double PosedCone::noise_m(const PosedEntity& entity, std::uint32_t triangle) const noexcept {
  double along_m = 0.0;
  double arm_m = 0.0;
  for (const glm::dvec3& corner : entity.corners_world(triangle)) {
    along_m = std::max(along_m, glm::length(corner - axis.origin_m));
    arm_m = std::max(arm_m, glm::length(corner - entity.pose.p_world_m));
  }
  return axis.noise_m(entity, along_m / axis.length, arm_m);
}

double PosedCone::noise_m(const PosedEntity& entity) const noexcept {
  const double far_m = glm::length(entity.pose.p_world_m - axis.origin_m) + entity.reach();
  return axis.noise_m(entity, far_m / axis.length, entity.reach());
}

double apex_height_m(const ConeCorners& c) noexcept {
  return -glm::dot(glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0])), c[0]);
}

bool admits(Faces faces, double height_m, double noise_m) noexcept {
  switch (faces) {
    case Faces::front:
      return height_m >= -noise_m;
    case Faces::back:
      return height_m <= noise_m;
    case Faces::both:
      break;
  }
  return true;
}

}  // namespace rtstdb::oracle
