#include "rtstdb/field/grid.hpp"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

#include "shaders/shared/field.h"

namespace rtstdb::field {

Grid grid_around(const Bounds& box, double cell_m) noexcept {
  const glm::dvec3 low(box.minimum_m);
  const glm::dvec3 high(box.maximum_m);
  const glm::dvec3 farthest = glm::max(glm::abs(low), glm::abs(high));
  const double magnitude_m = std::max({farthest.x, farthest.y, farthest.z});
  // Neighbouring vertices of a brick are at least 64 units in the last place apart. So no axis has more than
  // 2^16 cells.
  const double min_edge_m = 64.0 * static_cast<double>(std::numeric_limits<float>::epsilon()) * magnitude_m *
                            shared::field_brick_cells;
  Grid grid;
  grid.cell_m = static_cast<float>(std::max(cell_m, min_edge_m));
  const double edge_m = static_cast<double>(grid.cell_m);
  for (int axis = 0; axis < 3; ++axis) {
    const double needed = std::ceil((high[axis] - low[axis]) / edge_m + 1.0);
    grid.cells[axis] = static_cast<std::uint32_t>(std::max(needed, 1.0));
  }
  const glm::dvec3 middle = 0.5 * (low + high);
  grid.origin_m = glm::vec3(middle - 0.5 * edge_m * glm::dvec3(grid.cells));
  return grid;
}

}  // namespace rtstdb::field
