#pragma once
// The rectangle of the world that a picture shows, and its scale to pixels.

#include <span>
#include <vector>

#include "runtime/report/html/label_placement.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

bool is_finite(const PointM& point);

/// The least and the largest ratio of a picture's height to its width.
struct AspectLimits {
  double flattest = 0.42;
  double tallest = 0.6;
};

/// Whether the view has a shape, a track or a point.
bool has_content(const TopView& view);

/// The rectangle of the record; else the bounding box of bodies, detectors and tracks with a margin of 6 %,
/// at least 4 m, extended to the aspect ratio. Ground, roads, markings, sensor points and a static body
/// below all others do not count, unless there are no other bodies.
ViewBox window_of(const TopView& view, const AspectLimits& aspect = {});

/// The part of a polygon inside a rectangle (Sutherland-Hodgman; a concave outline may keep edges along the
/// border, which fills the same area). Empty when nothing is left or a coordinate is not finite.
std::vector<PointM> clipped(std::span<const PointM> polygon, const ViewBox& box);

/// World metres to pixels, one scale for both axes, y turned upwards.
class WorldToPixels {
 public:
  WorldToPixels(const ViewBox& window, double left, double top, double width);
  Pixel operator()(PointM point) const;
  std::vector<Pixel> operator()(std::span<const PointM> points) const;
  double pixels_per_metre() const { return scale_; }
  /// The plot's rectangle.
  const PixelBox& area() const { return area_; }

 private:
  ViewBox window_;
  double scale_;
  PixelBox area_;
};

PixelBox bounds_of(std::span<const Pixel> points);

}  // namespace hil::report
