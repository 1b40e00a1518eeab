#pragma once
// Places labels in a picture, so that none overlaps another or is cut off.

#include <optional>
#include <string>
#include <vector>

#include "runtime/report/html/svg.hpp"

namespace hil::report {

struct PixelBox {
  double left = 0.0;
  double top = 0.0;
  double right = 0.0;
  double bottom = 0.0;

  bool operator==(const PixelBox&) const = default;
  bool overlaps(const PixelBox& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
  bool contains(const PixelBox& other) const {
    return left <= other.left && other.right <= right && top <= other.top && other.bottom <= bottom;
  }
};

class LabelPlacement {
 public:
  explicit LabelPlacement(PixelBox area) : area_(area) {}

  /// No label will be placed here, except the label of the shape that the box belongs to.
  void reserve(const PixelBox& box) { taken_.push_back(box); }

  /// The left end of the text's baseline: inside `around` if it fits there, else beside, above or below it.
  /// Empty: no place is free.
  std::optional<Pixel> place(const std::string& text, const PixelBox& around);

 private:
  PixelBox area_;
  std::vector<PixelBox> taken_;
};

}  // namespace hil::report
