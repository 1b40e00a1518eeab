#pragma once
// Where the rays of a row of pixels are inside the oriented box of a body, at the time of the row.
//
// Threads: pure values; nothing allocates.

#include <glm/ext/matrix_double3x3.hpp>
#include <glm/ext/vector_double3.hpp>

#include <cstdint>
#include <optional>

#include <rtstdb/image.hpp>

namespace hil::modules {

/// A camera with the motion of its carrier.
struct CameraView {
  rtstdb::Camera camera{};
  std::optional<rtstdb::Motion> carrier{};  ///< of Camera::carrier, if it has one
  std::uint32_t width = 0, height = 0;
};

/// An oriented box: of the points of a body's frame, times its scale.
struct BodyBox {
  rtstdb::Motion motion{};
  glm::dvec3 center_m{0.0}, half_m{0.0};
};

/// Depths along the view direction.
struct DepthRange {
  double first_m = 0.0, last_m = 0.0;
};

class BoxInRow {
 public:
  /// The box is enlarged a little, so that rounding loses no pixel.
  BoxInRow(const CameraView& view, const BodyBox& box, std::uint32_t row) noexcept;

  /// Columns outside [first_column, end_column) do not meet the box.
  std::uint32_t first_column() const noexcept { return first_column_; }
  std::uint32_t end_column() const noexcept { return end_column_; }
  /// Where the ray of a pixel of the row is in the box, in front of Camera::near_m; empty: nowhere.
  std::optional<DepthRange> depths(std::uint32_t column) const noexcept;

 private:
  void find_columns(std::uint32_t height, std::uint32_t row) noexcept;

  double half_width_, down_;  // tangents
  double near_m_;
  std::uint32_t width_;
  glm::dmat3 to_box_;
  glm::dvec3 eye_m_, half_m_;  // in the frame of the box
  std::uint32_t first_column_ = 0, end_column_ = 0;
};

}  // namespace hil::modules
