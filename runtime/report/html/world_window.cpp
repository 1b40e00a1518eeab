#include "runtime/report/html/world_window.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hil::report {
namespace {

constexpr double margin_share = 0.06;
constexpr double min_margin_m = 4.0;

class Bounds {
 public:
  void add(const PointM& point) {
    if (!is_finite(point)) return;
    box_.minimum = {std::min(box_.minimum.x_m, point.x_m), std::min(box_.minimum.y_m, point.y_m)};
    box_.maximum = {std::max(box_.maximum.x_m, point.x_m), std::max(box_.maximum.y_m, point.y_m)};
  }
  void add(const Bounds& other) {
    if (other.empty()) return;
    add(other.box_.minimum);
    add(other.box_.maximum);
  }
  bool empty() const { return box_.minimum.x_m > box_.maximum.x_m; }
  bool covers(const Bounds& other) const {
    return box_.minimum.x_m <= other.box_.minimum.x_m && box_.minimum.y_m <= other.box_.minimum.y_m &&
           box_.maximum.x_m >= other.box_.maximum.x_m && box_.maximum.y_m >= other.box_.maximum.y_m;
  }
  double area() const {
    return (box_.maximum.x_m - box_.minimum.x_m) * (box_.maximum.y_m - box_.minimum.y_m);
  }
  const ViewBox& box() const { return box_; }

 private:
  static constexpr double far = std::numeric_limits<double>::infinity();
  ViewBox box_{{far, far}, {-far, -far}};
};

Bounds bounds_of_footprint(const Shape& shape) {
  Bounds bounds;
  for (const PointM& point : shape.footprint)
    bounds.add(point);
  return bounds;
}

/// Adds the static bodies to `bounds`, except ground that is modelled as a body: the largest ones that
/// cover all smaller ones.
void add_structures(std::vector<Bounds> structures, Bounds& bounds) {
  std::ranges::sort(structures, {}, &Bounds::area);
  std::vector<Bounds> with_smaller{bounds};  // [i]: `bounds` and the structures before i
  for (const Bounds& structure : structures) {
    with_smaller.push_back(with_smaller.back());
    with_smaller.back().add(structure);
  }
  std::size_t kept = structures.size();
  while (kept > 0 && !with_smaller[kept - 1].empty() && structures[kept - 1].covers(with_smaller[kept - 1]))
    --kept;
  bounds = with_smaller[kept];
}

Bounds of_tracks(const TopView& view) {
  Bounds bounds;
  for (const Track& track : view.tracks) {
    for (const TrackPoint& point : track.points)
      bounds.add(PointM{point.x_m, point.y_m});
  }
  return bounds;
}

Bounds of_interest(const TopView& view) {
  Bounds bounds = of_tracks(view);
  std::vector<Bounds> structures;
  for (const Shape& shape : view.shapes) {
    if (shape.layer < Layer::detector) continue;
    const Bounds of_shape = bounds_of_footprint(shape);
    if (shape.layer != Layer::structure) {
      bounds.add(of_shape);
    } else if (!of_shape.empty()) {
      structures.push_back(of_shape);
    }
  }
  add_structures(std::move(structures), bounds);
  return bounds;
}

Bounds of_everything(const TopView& view) {
  Bounds bounds = of_tracks(view);
  for (const Shape& shape : view.shapes)
    bounds.add(bounds_of_footprint(shape));
  for (const SensorPoint& point : view.scan_points)
    bounds.add(PointM{point.x_m, point.y_m});
  return bounds;
}

ViewBox grown(const ViewBox& box, double by_x, double by_y) {
  return {{box.minimum.x_m - by_x, box.minimum.y_m - by_y}, {box.maximum.x_m + by_x, box.maximum.y_m + by_y}};
}

bool is_usable(const ViewBox& box) {
  const double width = box.maximum.x_m - box.minimum.x_m;
  const double height = box.maximum.y_m - box.minimum.y_m;
  return std::isfinite(width) && std::isfinite(height) && width > 0.0 && height > 0.0;
}

ViewBox with_aspect(const ViewBox& box, const AspectLimits& aspect) {
  const double width = box.maximum.x_m - box.minimum.x_m;
  const double height = box.maximum.y_m - box.minimum.y_m;
  if (height < aspect.flattest * width) return grown(box, 0.0, (aspect.flattest * width - height) / 2.0);
  if (height > aspect.tallest * width) return grown(box, (height / aspect.tallest - width) / 2.0, 0.0);
  return box;
}

/// The part of the polygon with inside(p) >= 0; edges that cross the border are interpolated.
template <class Distance>
std::vector<PointM> cut(const std::vector<PointM>& polygon, Distance inside) {
  std::vector<PointM> kept;
  for (std::size_t index = 0; index < polygon.size(); ++index) {
    const PointM& from = polygon[index];
    const PointM& to = polygon[(index + 1) % polygon.size()];
    const double before = inside(from);
    const double after = inside(to);
    if (before >= 0.0) kept.push_back(from);
    if ((before >= 0.0) == (after >= 0.0)) continue;
    const double share = before / (before - after);
    kept.push_back({from.x_m + share * (to.x_m - from.x_m), from.y_m + share * (to.y_m - from.y_m)});
  }
  return kept;
}

}  // namespace

bool is_finite(const PointM& point) {
  return std::isfinite(point.x_m) && std::isfinite(point.y_m);
}

bool has_content(const TopView& view) {
  return !of_everything(view).empty();
}

ViewBox window_of(const TopView& view, const AspectLimits& aspect) {
  if (view.view && is_usable(*view.view)) return with_aspect(*view.view, aspect);
  Bounds bounds = of_interest(view);
  if (bounds.empty()) bounds = of_everything(view);
  if (bounds.empty()) return {{-50.0, -30.0}, {50.0, 30.0}};
  const ViewBox& box = bounds.box();
  const double extent = std::max(box.maximum.x_m - box.minimum.x_m, box.maximum.y_m - box.minimum.y_m);
  const double margin = std::max(margin_share * extent, min_margin_m);
  const ViewBox window = with_aspect(grown(box, margin, margin), aspect);
  return is_usable(window) ? window : ViewBox{{-50.0, -30.0}, {50.0, 30.0}};
}

std::vector<PointM> clipped(std::span<const PointM> polygon, const ViewBox& box) {
  if (!std::ranges::all_of(polygon, is_finite)) return {};
  std::vector<PointM> rest(polygon.begin(), polygon.end());
  rest = cut(rest, [&](const PointM& p) { return p.x_m - box.minimum.x_m; });
  rest = cut(rest, [&](const PointM& p) { return box.maximum.x_m - p.x_m; });
  rest = cut(rest, [&](const PointM& p) { return p.y_m - box.minimum.y_m; });
  rest = cut(rest, [&](const PointM& p) { return box.maximum.y_m - p.y_m; });
  return rest;
}

WorldToPixels::WorldToPixels(const ViewBox& window, double left, double top, double width)
    : window_(window),
      scale_(width / (window.maximum.x_m - window.minimum.x_m)),
      area_{left, top, left + width, top + scale_ * (window.maximum.y_m - window.minimum.y_m)} {}

Pixel WorldToPixels::operator()(PointM point) const {
  return {area_.left + scale_ * (point.x_m - window_.minimum.x_m),
          area_.top + scale_ * (window_.maximum.y_m - point.y_m)};
}

std::vector<Pixel> WorldToPixels::operator()(std::span<const PointM> points) const {
  std::vector<Pixel> result;
  for (const PointM& point : points) {
    if (is_finite(point)) result.push_back((*this)(point));
  }
  return result;
}

PixelBox bounds_of(std::span<const Pixel> points) {
  if (points.empty()) return {};
  PixelBox box{points.front().x, points.front().y, points.front().x, points.front().y};
  for (const Pixel& point : points) {
    box.left = std::min(box.left, point.x);
    box.right = std::max(box.right, point.x);
    box.top = std::min(box.top, point.y);
    box.bottom = std::max(box.bottom, point.y);
  }
  return box;
}

}  // namespace hil::report
