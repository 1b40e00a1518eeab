#include "runtime/report/html/point_picture.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "runtime/report/html/axis.hpp"
#include "runtime/report/html/world_window.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

constexpr double width = 340.0;
constexpr double side = 10.0;
constexpr double top_band = 34.0;
constexpr double first_line_below = 26.0;  // from the lower border of the points to the first dimension
constexpr double line_distance = 28.0;
constexpr std::uint32_t colours = 8;

/// A point in the picture plane: along the picture's right, and up.
struct Seen {
  PointM at;
  std::uint32_t entity = 0;
};

std::vector<Seen> seen_points(const Picture& picture) {
  std::vector<Seen> seen;
  for (const SensorPoint& point : picture.points) {
    const PointM at{point.x_m * picture.right[0] + point.y_m * picture.right[1], point.z_m};
    if (is_finite(at)) seen.push_back({at, point.entity});
  }
  return seen;
}

/// Extent of the subject's points; not usable() without any.
struct Extent {
  double from_m = std::numeric_limits<double>::infinity();
  double to_m = -from_m;
  double low_m = from_m;
  double high_m = -from_m;
  bool usable() const { return from_m <= to_m; }
  double middle_m() const { return usable() ? (from_m + to_m) / 2.0 : 0.0; }
};

Extent extent_of(std::span<const Seen> points, std::uint32_t subject) {
  Extent extent;
  for (const Seen& point : points) {
    if (subject != contribution::no_subject && point.entity != subject) continue;
    extent.from_m = std::min(extent.from_m, point.at.x_m);
    extent.to_m = std::max(extent.to_m, point.at.x_m);
    extent.low_m = std::min(extent.low_m, point.at.y_m);
    extent.high_m = std::max(extent.high_m, point.at.y_m);
  }
  return extent;
}

class Drawing {
 public:
  Drawing(Markup& out, const Picture& picture, const PictureFrame& frame)
      : out_(out),
        picture_(picture),
        points_(seen_points(picture)),
        extent_(extent_of(points_, picture.subject)),
        window_{{extent_.middle_m() - frame.width_m / 2.0, frame.bottom_z_m},
                {extent_.middle_m() + frame.width_m / 2.0, frame.bottom_z_m + frame.height_m}},
        place_(window_, side, top_band, width - 2 * side) {}

  void draw(PictureUse use) {
    const PixelBox& area = place_.area();
    const std::size_t lines_below = picture_.dimensions.empty() ? 0 : picture_.dimensions.size() - 1;
    const double below = area.bottom + first_line_below;
    const double scale_bar_y = below + line_distance * static_cast<double>(lines_below) + 4.0;
    open_svg(out_, width, scale_bar_y + 10.0, picture_.title, use);
    out_.leaf("rect", {{"class", "land"},
                       {"x", area.left},
                       {"y", area.top},
                       {"width", area.right - area.left},
                       {"height", area.bottom - area.top}});
    outline();
    clouds();
    for (std::size_t i = 0; i < picture_.dimensions.size(); ++i) {
      const double y = i == 0 ? top_band - 8.0 : below + line_distance * static_cast<double>(i - 1);
      dimension_line(i == 0 ? "rule" : "rule-soft", picture_.dimensions[i], y);
    }
    scale_bar(scale_bar_y);
    if (!extent_.usable()) {
      svg_text(out_, "", {width / 2.0, (area.top + area.bottom) / 2.0}, "middle",
               "no point of the body was seen");
    }
    out_.close();
  }

 private:
  /// The real length of the subject, around its points.
  void outline() {
    if (!extent_.usable() || !(picture_.outline_length_m > 0.0)) return;
    const double half = picture_.outline_length_m / 2.0;
    const Pixel corner = place_({extent_.middle_m() - half, extent_.high_m});
    const Pixel opposite = place_({extent_.middle_m() + half, extent_.low_m});
    out_.leaf("rect", {{"class", "ghost"},
                       {"x", corner.x},
                       {"y", corner.y},
                       {"width", opposite.x - corner.x},
                       {"height", opposite.y - corner.y}});
  }

  void clouds() {
    std::array<std::vector<Pixel>, colours> by_colour;
    for (const Seen& point : points_) {
      const Pixel at = place_(point.at);
      const PixelBox& area = place_.area();
      const bool visible = at.x >= area.left && at.x <= area.right && at.y >= area.top && at.y <= area.bottom;
      if (visible) by_colour[point.entity % colours].push_back(at);
    }
    for (std::uint32_t colour = 0; colour < colours; ++colour) {
      if (by_colour[colour].empty()) continue;
      out_.leaf("path", {{"class", "cloud c" + std::to_string(colour)}, {"d", svg_dots(by_colour[colour])}});
    }
  }

  /// A line as long as the dimension at the picture's scale, its name above it.
  void dimension_line(const char* css_class, const contribution::Dimension& dimension, double y) {
    const double middle = width / 2.0;
    const double length_m = dimension.length_m;
    const bool known = std::isfinite(length_m);
    svg_text(out_, "strong", {middle, y - 8.0}, "middle",
             dimension.name + ' ' + (known ? decimal(length_m, 3) + " m" : std::string("not known")));
    if (!known || length_m < 0.0) return;
    const double half = std::min(length_m * place_.pixels_per_metre() / 2.0, middle - 2.0);
    svg_line(out_, css_class, {middle - half, y}, {middle + half, y});
    svg_line(out_, "rule", {middle - half, y - 5.0}, {middle - half, y + 5.0});
    svg_line(out_, "rule", {middle + half, y - 5.0}, {middle + half, y + 5.0});
  }

  void scale_bar(double y) {
    const double length_m = linear_step((window_.maximum.x_m - window_.minimum.x_m) / 16.0, 2);
    const double length = length_m * place_.pixels_per_metre();
    svg_line(out_, "rule", {side, y}, {side + length, y});
    svg_line(out_, "rule", {side, y - 4.0}, {side, y + 4.0});
    svg_line(out_, "rule", {side + length, y - 4.0}, {side + length, y + 4.0});
    svg_text(out_, "", {side + length + 8.0, y + 4.0}, "start", shortest(length_m) + " m, across and up");
  }

  Markup& out_;
  const Picture& picture_;
  std::vector<Seen> points_;
  Extent extent_;
  ViewBox window_;
  WorldToPixels place_;
};

}  // namespace

PictureFrame common_frame(std::span<const Picture> pictures) {
  double length_m = 0.0;
  double low_m = std::numeric_limits<double>::infinity();
  double high_m = -low_m;
  for (const Picture& picture : pictures) {
    const Extent extent = extent_of(seen_points(picture), picture.subject);
    if (std::isfinite(picture.outline_length_m)) length_m = std::max(length_m, picture.outline_length_m);
    for (const contribution::Dimension& dimension : picture.dimensions) {
      if (std::isfinite(dimension.length_m)) length_m = std::max(length_m, dimension.length_m);
    }
    if (!extent.usable()) continue;
    length_m = std::max(length_m, extent.to_m - extent.from_m);
    low_m = std::min(low_m, extent.low_m);
    high_m = std::max(high_m, extent.high_m);
  }
  if (!(length_m > 0.0) || !std::isfinite(length_m)) return {10.0, 4.0, 0.0};
  const double frame_width = 1.15 * length_m;
  const double seen_height = low_m <= high_m ? high_m - low_m : 0.0;
  // No flatter than a readable strip, no taller than wide.
  const double height = std::clamp(1.5 * seen_height, 0.3 * frame_width, frame_width);
  const double middle = low_m <= high_m ? (low_m + high_m) / 2.0 : 0.0;
  return {frame_width, height, middle - height / 2.0};
}

void draw_point_picture(Markup& out, const Picture& picture, const PictureFrame& frame, PictureUse use) {
  Drawing(out, picture, frame).draw(use);
}

}  // namespace hil::report
