#include "rtstdb/oracle/watertight.hpp"

#include <cmath>
#include <utility>

namespace rtstdb::oracle {
namespace {

/// ax * by - ay * bx with the exact sign. Rounding is monotonic, so rounded products that differ have the
/// right order; for equal ones the rounding errors decide. Swapping the arguments changes the sign alone.
double edge_function(double ax, double ay, double bx, double by) noexcept {
  const double left = ax * by;
  const double right = ay * bx;
  if (left != right) return left - right;
  return std::fma(ax, by, -left) - std::fma(ay, bx, -right);
}

}  // namespace

WatertightTest::WatertightTest(const LocalRay& ray) noexcept : origin_(ray.origin) {
  const glm::dvec3 size = glm::abs(ray.direction);
  z_ = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
  x_ = (z_ + 1) % 3;
  y_ = (z_ + 2) % 3;
  // Keeps the orientation.
  if (ray.direction[z_] < 0.0) std::swap(x_, y_);
  shear_x_ = ray.direction[x_] / ray.direction[z_];
  shear_y_ = ray.direction[y_] / ray.direction[z_];
  shear_z_ = 1.0 / ray.direction[z_];
}

std::optional<TriangleHit> WatertightTest::operator()(const std::array<glm::dvec3, 3>& corners,
                                                      double lambda_min, double lambda_max) const noexcept {
  std::array<double, 3> x{};
  std::array<double, 3> y{};
  std::array<double, 3> z{};
  for (std::size_t i = 0; i < 3; ++i) {
    const glm::dvec3 seen = corners[i] - origin_;
    x[i] = seen[x_] - shear_x_ * seen[z_];
    y[i] = seen[y_] - shear_y_ * seen[z_];
    z[i] = shear_z_ * seen[z_];
  }
  // Weight of each corner: the area opposite to it.
  const double a = edge_function(x[2], y[2], x[1], y[1]);
  const double b = edge_function(x[0], y[0], x[2], y[2]);
  const double c = edge_function(x[1], y[1], x[0], y[0]);
  if ((a < 0.0 || b < 0.0 || c < 0.0) && (a > 0.0 || b > 0.0 || c > 0.0)) return std::nullopt;
  const double sum = a + b + c;
  if (sum == 0.0) return std::nullopt;
  const double lambda = (a * z[0] + b * z[1] + c * z[2]) / sum;
  if (!(lambda >= lambda_min && lambda <= lambda_max)) return std::nullopt;
  return TriangleHit{lambda, b / sum, c / sum};
}

}  // namespace rtstdb::oracle
