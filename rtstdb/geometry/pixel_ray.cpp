#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>

#include <rtstdb/query.hpp>
#include <rtstdb/result.hpp>

namespace rtstdb {

Ray pixel_ray(const Camera& camera, std::uint32_t width, std::uint32_t height, std::uint32_t column,
              std::uint32_t row) noexcept {
  RTSTDB_REQUIRE(
      column < width && row < height, "pixel_ray",
      "the pixel lies beyond the image; its column is below the width and its row below the height");
  const double half_x = std::tan(0.5 * static_cast<double>(camera.horizontal_angle_rad));
  const double half_y = half_x * height / width;
  const double right = (2.0 * column + 1.0) / width - 1.0;
  const double down = (2.0 * row + 1.0) / height - 1.0;
  const glm::dquat q = glm::normalize(glm::dquat(camera.q));
  return {.origin_m = camera.p_m,
          .direction = glm::vec3(q * glm::dvec3(1.0, -right * half_x, -down * half_y)),
          .lambda_min = camera.near_m,
          .t = camera.t + row * camera.row_time + camera.exposure / 2,
          .mask = camera.mask,
          .carrier = camera.carrier};
}

}  // namespace rtstdb
