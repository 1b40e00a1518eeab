#include "runtime/modules/camera/box_in_row.hpp"

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/matrix.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hil::modules {
namespace {

/// What single precision and rounded bounds may be off by: of the box, of its size, of its distance.
constexpr double margin_m = 1e-3, margin_of_size = 1e-3, margin_of_distance = 1e-5;

rtstdb::Pose pose_of(const CameraView& view, rtstdb::WorldTime t) noexcept {
  const rtstdb::Pose mount{glm::dvec3(view.camera.p_m), glm::normalize(glm::dquat(view.camera.q))};
  if (!view.carrier) return mount;
  const rtstdb::Pose carrier = rtstdb::pose_at(*view.carrier, t);
  return {carrier.p_world_m + carrier.q_world * mount.p_world_m, carrier.q_world * mount.q_world};
}

}  // namespace

BoxInRow::BoxInRow(const CameraView& view, const BodyBox& box, std::uint32_t row) noexcept
    : half_width_(std::tan(0.5 * static_cast<double>(view.camera.horizontal_angle_rad))),
      down_(((2.0 * row + 1.0) / view.height - 1.0) * half_width_ * view.height / view.width),
      near_m_(static_cast<double>(view.camera.near_m)),
      width_(view.width) {
  const rtstdb::Camera& camera = view.camera;
  const rtstdb::WorldTime t = camera.t + row * camera.row_time + camera.exposure / 2;
  const rtstdb::Pose eye = pose_of(view, t);
  const rtstdb::Pose body = rtstdb::pose_at(box.motion, t);
  const glm::dquat to_body = glm::conjugate(body.q_world);
  to_box_ = glm::mat3_cast(to_body * eye.q_world);
  eye_m_ = to_body * (eye.p_world_m - body.p_world_m) - box.center_m;
  half_m_ = box.half_m * (1.0 + margin_of_size) + margin_m + margin_of_distance * glm::length(eye_m_);
  find_columns(view.height, row);
}

void BoxInRow::find_columns(std::uint32_t height, std::uint32_t row) noexcept {
  const double half_height = half_width_ * height / width_;
  double left = std::numeric_limits<double>::infinity(), right = -left;
  double top = left, bottom = -left;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 sign{corner & 1 ? 1.0 : -1.0, corner & 2 ? 1.0 : -1.0, corner & 4 ? 1.0 : -1.0};
    const glm::dvec3 at = glm::transpose(to_box_) * (sign * half_m_ - eye_m_);
    if (at.x < near_m_) {  // the projection of the corners does not bound that of the box
      first_column_ = 0;
      end_column_ = width_;
      return;
    }
    const double column = 0.5 * width_ * (1.0 - at.y / at.x / half_width_);
    const double line = 0.5 * height * (1.0 - at.z / at.x / half_height);
    left = std::min(left, column);
    right = std::max(right, column);
    top = std::min(top, line);
    bottom = std::max(bottom, line);
  }
  if (row + 1.0 < top || row > bottom || right < 0.0 || left > width_) return;
  first_column_ = static_cast<std::uint32_t>(std::max(0.0, std::floor(left)));
  end_column_ = static_cast<std::uint32_t>(std::min<double>(width_, std::ceil(right)));
}

std::optional<DepthRange> BoxInRow::depths(std::uint32_t column) const noexcept {
  const double right = ((2.0 * column + 1.0) / width_ - 1.0) * half_width_;
  const glm::dvec3 direction = to_box_ * glm::dvec3(1.0, -right, -down_);
  DepthRange range{near_m_, std::numeric_limits<double>::infinity()};
  for (int axis = 0; axis < 3; ++axis) {
    const double to_low = -half_m_[axis] - eye_m_[axis], to_high = half_m_[axis] - eye_m_[axis];
    if (direction[axis] == 0.0) {
      if (to_low > 0.0 || to_high < 0.0) return std::nullopt;
      continue;
    }
    const double a = to_low / direction[axis], b = to_high / direction[axis];
    range.first_m = std::max(range.first_m, std::min(a, b));
    range.last_m = std::min(range.last_m, std::max(a, b));
  }
  if (range.first_m > range.last_m) return std::nullopt;
  return range;
}

}  // namespace hil::modules
