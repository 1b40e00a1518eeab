#include "runtime/report/html/label_placement.hpp"

#include <algorithm>
#include <array>

namespace hil::report {
namespace {

constexpr double font_size = 11.0;
constexpr double line_height = 14.0;
constexpr double gap = 4.0;

}  // namespace

std::optional<Pixel> LabelPlacement::place(const std::string& text, const PixelBox& around) {
  const double width = text_width(text, font_size);
  const double centre_x = (around.left + around.right) / 2.0;
  const double centre_y = (around.top + around.bottom) / 2.0;
  const double left_of_centre = centre_x - width / 2.0;
  const double top_of_centre = centre_y - line_height / 2.0;
  const bool inside =
      width + 2 * gap <= around.right - around.left && line_height <= around.bottom - around.top;
  const double right_side = around.right + gap;
  const double left_side = around.left - gap - width;
  const double above = around.top - gap - line_height;
  const double below = around.bottom + gap;
  std::vector<Pixel> corners;
  if (inside) corners.push_back({left_of_centre, top_of_centre});
  corners.insert(corners.end(), {{right_side, top_of_centre},
                                 {left_side, top_of_centre},
                                 {left_of_centre, above},
                                 {left_of_centre, below},
                                 {right_side, above},
                                 {right_side, below},
                                 {left_side, above},
                                 {left_side, below}});
  for (const Pixel& corner : corners) {
    const PixelBox box{corner.x, corner.y, corner.x + width, corner.y + line_height};
    const bool free =
        std::ranges::none_of(taken_, [&](const PixelBox& other) { return other.overlaps(box); });
    if (!free || !area_.contains(box)) continue;
    taken_.push_back(box);
    return Pixel{corner.x, corner.y + line_height - gap};
  }
  return std::nullopt;
}

}  // namespace hil::report
