#pragma once
// A picture of a section: measured points seen along a horizontal direction, with the dimensions of their
// subject as lines to the same scale.

#include <span>

#include "runtime/report/html/svg.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

/// The part of the picture plane that all pictures of one section show, so that they have one scale.
struct PictureFrame {
  double width_m = 1.0;
  double height_m = 1.0;
  double bottom_z_m = 0.0;  ///< height of the lower border
};

PictureFrame common_frame(std::span<const Picture> pictures);

/// The picture is centred on its subject.
void draw_point_picture(Markup& out, const Picture& picture, const PictureFrame& frame, PictureUse use);

}  // namespace hil::report
