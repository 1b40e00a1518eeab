#include "runtime/report/html/label_placement.hpp"

#include <algorithm>

namespace hil::report {
namespace {

constexpr double font_size = 11.0;
constexpr double line_height = 14.0;
constexpr double gap = 4.0;

/// Upper left corners for a label of `width`, the best first.
std::vector<Pixel> candidates(const PixelBox& around, double width) {
  const double middle_x = (around.left + around.right) / 2.0 - width / 2.0;
  const double middle_y = (around.top + around.bottom) / 2.0 - line_height / 2.0;
  std::vector<Pixel> corners;
  const bool fits =
      width + 2 * gap <= around.right - around.left && line_height <= around.bottom - around.top;
  if (fits) corners.push_back({middle_x, middle_y});
  for (const double distance : {gap, 4 * gap, 8 * gap}) {
    const double right = around.right + distance;
    const double left = around.left - distance - width;
    const double above = around.top - distance - line_height;
    const double below = around.bottom + distance;
    corners.insert(corners.end(), {{right, middle_y},
                                   {left, middle_y},
                                   {middle_x, above},
                                   {middle_x, below},
                                   {right, above},
                                   {right, below},
                                   {left, above},
                                   {left, below}});
  }
  return corners;
}

}  // namespace

std::optional<Pixel> LabelPlacement::place(const std::string& text, const PixelBox& around) {
  const double width = text_width(text, font_size);
  for (const Pixel& corner : candidates(around, width)) {
    const PixelBox box{corner.x, corner.y, corner.x + width, corner.y + line_height};
    const bool inside = around.contains(box);
    const auto in_the_way = [&](const PixelBox& other) {
      return other.overlaps(box) && !(inside && other == around);
    };
    if (!area_.contains(box) || std::ranges::any_of(taken_, in_the_way)) continue;
    taken_.push_back(box);
    return Pixel{corner.x, corner.y + line_height - gap};
  }
  return std::nullopt;
}

}  // namespace hil::report
