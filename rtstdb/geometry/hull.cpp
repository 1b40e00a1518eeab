#include <cmath>
#include <cstdio>
#include <limits>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <rtstdb/geometry.hpp>
#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/geometry/hull_triangles.hpp"
#include "rtstdb/geometry/ulp.hpp"
#include "rtstdb/geometry/value_text.hpp"

namespace rtstdb {
namespace {

Error no_hull(std::size_t points, const std::string& fault) {
  return {ErrorCode::bad_input, std::to_string(points) + " points" + fault};
}

}  // namespace

Result<HullTriangles> checked_hull(std::span<const glm::vec3> points_m) {
  const std::size_t count = points_m.size();
  for (std::size_t i = 0; i < count; ++i) {
    const glm::vec3& p_m = points_m[i];
    if (!std::isfinite(p_m.x) || !std::isfinite(p_m.y) || !std::isfinite(p_m.z))
      return no_hull(count, ", of which point " + std::to_string(i) + " is " + text_of(glm::dvec3(p_m)) +
                                "; finite numbers are needed");
  }
  if (count < 4) return no_hull(count, ", which span no volume; at least 4 are needed");
  const double limit_m = hull_tolerance_ulp * ulp_m(points_m);
  auto hull = hull_triangles(points_m);
  const auto thin = hull ? thin_direction(*hull, points_m, limit_m) : ThinDirection{};
  if (!thin) return std::move(*hull);
  char text[160];
  std::snprintf(text, sizeof text,
                " that are too thin: they are %.4g m thick, and at least %.4g m are needed, which is %g "
                "times the precision of their largest coordinate",
                thin->extent_m, limit_m, hull_tolerance_ulp);
  return no_hull(count, text);
}

Result<TriangleMesh> make_hull(std::span<const glm::vec3> points_m) {
  auto hull = checked_hull(points_m);
  if (!hull) return Error{hull.error().code, "a hull of " + hull.error().message};
  const HullTriangles& surface = hull.value();
  std::vector<std::uint32_t> number(points_m.size());
  TriangleMesh mesh;
  for (const std::uint32_t corner : surface.corners) {
    number[corner] = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.push_back(points_m[corner]);
  }
  for (const glm::uvec3& t : surface.triangles)
    mesh.triangles.emplace_back(number[t.x], number[t.y], number[t.z]);
  return mesh;
}

}  // namespace rtstdb
