#include "bench/contact/random_hulls.hpp"

#include <glm/geometric.hpp>

namespace hil::bench {
namespace {

constexpr int corners = 100;

}  // namespace

glm::dvec3 random_direction(std::mt19937_64& engine) {
  std::normal_distribution<double> normal;
  const double x = normal(engine);
  const double y = normal(engine);
  return glm::normalize(glm::dvec3(x, y, normal(engine)));
}

std::vector<rtstdb::TriangleMesh> random_hulls(std::mt19937_64& engine) {
  std::uniform_real_distribution<double> half_axis_m(0.3, 1.0);
  std::vector<rtstdb::TriangleMesh> hulls;
  for (int i = 0; i < hull_count; ++i) {
    const double x_m = half_axis_m(engine);
    const double y_m = half_axis_m(engine);
    const glm::dvec3 half_axes_m(x_m, y_m, half_axis_m(engine));
    std::vector<glm::vec3> points_m;
    for (int k = 0; k < corners; ++k)
      points_m.emplace_back(half_axes_m * random_direction(engine));
    hulls.push_back(rtstdb::make_hull(points_m).value());
  }
  return hulls;
}

}  // namespace hil::bench
