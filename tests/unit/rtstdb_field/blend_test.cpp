// The blend of the vertices of a cell, on shapes whose distance is known in closed form.

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>
#include <vector>

#include "rtstdb/field/stored_field.hpp"

namespace rtstdb::field {
namespace {

struct Distance {
  double distance_m = 0.0;
  glm::dvec3 gradient{0.0};
};
using Shape = std::function<Distance(const glm::dvec3&)>;

Distance to_sphere(const glm::dvec3& p) {
  const double radius_m = glm::length(p);
  return {radius_m - 1.0, p / radius_m};
}

/// A square of edge 2 in the plane z = 0; without sign.
Distance to_square(const glm::dvec3& p) {
  const glm::dvec3 nearest(std::clamp(p.x, -1.0, 1.0), std::clamp(p.y, -1.0, 1.0), 0.0);
  const double distance_m = glm::distance(p, nearest);
  return {distance_m, (p - nearest) / distance_m};
}

/// Two parallel walls, 1 m apart; the space between them is outside.
Distance between_walls(const glm::dvec3& p) {
  return p.z < 0.5 ? Distance{p.z, {0.0, 0.0, 1.0}} : Distance{1.0 - p.z, {0.0, 0.0, -1.0}};
}

Cell cell_at(const Shape& shape, const glm::dvec3& origin_m, double edge_m, const glm::dvec3& point_m) {
  const glm::dvec3 in_cells = (point_m - origin_m) / edge_m;
  const glm::dvec3 number = glm::floor(in_cells);
  Cell cell;
  cell.edge_m = edge_m;
  cell.at = in_cells - number;
  for (std::uint32_t k = 0; k < 8; ++k) {
    const Distance there = shape(origin_m + edge_m * (number + glm::dvec3(k & 1, k >> 1 & 1, k >> 2 & 1)));
    cell.distances_m[k] = there.distance_m;
    cell.gradients[k] = there.gradient;
  }
  return cell;
}

double blended_order_0(const Cell& cell) {
  double sum_m = 0.0;
  for (int k = 0; k < 8; ++k) {
    const glm::dvec3 parts = glm::mix(1.0 - cell.at, cell.at, glm::dvec3(k & 1, k >> 1 & 1, k >> 2 & 1));
    sum_m += parts.x * parts.y * parts.z * cell.distances_m[static_cast<std::size_t>(k)];
  }
  return sum_m;
}

/// Quantiles of the error, in cells, at points within a cell of the surface.
struct Errors {
  double p99 = 0.0, max = 0.0, order_0_p99 = 0.0;
};

Errors errors(const Shape& shape, double edge_m, bool is_signed) {
  std::mt19937_64 random(48);
  std::uniform_real_distribution<double> uniform(-1.6, 1.6);
  const glm::dvec3 origin_m(0.0137, -0.0071, 0.0049);
  std::vector<double> found, order_0;
  while (found.size() < 20'000) {
    const glm::dvec3 point_m(uniform(random), uniform(random), uniform(random));
    const double truth_m = std::abs(shape(point_m).distance_m);
    if (truth_m > edge_m) continue;
    const Cell cell = cell_at(shape, origin_m, edge_m, point_m);
    found.push_back(std::abs(std::abs(blended_distance_m(cell, is_signed)) - truth_m) / edge_m);
    order_0.push_back(std::abs(std::abs(blended_order_0(cell)) - truth_m) / edge_m);
  }
  std::ranges::sort(found);
  std::ranges::sort(order_0);
  return {found[found.size() * 99 / 100], found.back(), order_0[order_0.size() * 99 / 100]};
}

/// On a smooth surface the error falls with the third power of the cells' edge, that of order 0 with the
/// second.
TEST(FieldBlend, IsOfThirdOrderOnASphere) {
  const Errors coarse = errors(to_sphere, 0.2, true);
  const Errors fine = errors(to_sphere, 0.1, true);
  EXPECT_LT(coarse.p99, 0.002);
  EXPECT_GT(0.2 * coarse.p99 / (0.1 * fine.p99), 6.0);
  EXPECT_LT(0.2 * coarse.order_0_p99 / (0.1 * fine.order_0_p99), 5.0);
  EXPECT_GT(fine.order_0_p99 / fine.p99, 30.0);
}

/// Without signs, cells that the surface crosses are nearly as precise as with them.
TEST(FieldBlend, KeepsTheSurfaceSharpWithoutSigns) {
  const Errors errors_of_sphere = errors(
      [](const glm::dvec3& p) {
        const Distance there = to_sphere(p);
        return there.distance_m < 0.0 ? Distance{-there.distance_m, -there.gradient} : there;
      },
      0.1, false);
  EXPECT_LT(errors_of_sphere.p99, 0.03);
  EXPECT_LT(errors_of_sphere.max, 0.2);
  EXPECT_GT(errors_of_sphere.order_0_p99, 0.3);
}

/// A sheet without thickness is found inside of cells: its distance there is zero, where the blended
/// distances of the vertices are half a cell.
TEST(FieldBlend, FindsASheetInsideOfCells) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> uniform(-0.85, 0.85);
  for (int i = 0; i < 1000; ++i) {
    const glm::dvec3 on_sheet(uniform(random), uniform(random), 1e-9);
    const Cell cell = cell_at(to_square, {0.01, 0.02, 0.013}, 0.1, on_sheet);
    EXPECT_NEAR(blended_distance_m(cell, false), 0.0, 1e-8) << on_sheet.x << ", " << on_sheet.y;
  }
}

/// Without sign a thin plate, which has no vertex inside, is found as well.
TEST(FieldBlend, DropsSigns) {
  const Cell inside = cell_at(to_sphere, {0.01, 0.02, 0.013}, 0.05, {0.8, 0.0, 0.0});
  EXPECT_NEAR(blended_distance_m(inside, true), -0.2, 1e-4);
  EXPECT_NEAR(blended_distance_m(inside, false), 0.2, 1e-4);
}

/// In the middle between two walls gradients disagree; the error stays below a half of a cell.
TEST(FieldBlend, IsBoundedWhereGradientsDisagree) {
  for (double z = 0.3; z < 0.7; z += 0.01) {
    const Cell cell = cell_at(between_walls, {0.0, 0.0, 0.03}, 0.1, {0.0, 0.0, z});
    EXPECT_NEAR(blended_distance_m(cell, true), between_walls({0.0, 0.0, z}).distance_m, 0.05) << z;
  }
}

}  // namespace
}  // namespace rtstdb::field
