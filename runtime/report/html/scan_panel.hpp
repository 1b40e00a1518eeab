#pragma once
// One panel of the comparison after the paper's Figure 8: a body's points as the scanner saw them, with the
// length that was measured, the length the closed form gives, and the body's true length.

#include <optional>
#include <span>
#include <string>

#include "runtime/report/html/svg.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

/// The part of the picture plane that all panels of one comparison show, so that they share one scale.
struct PanelFrame {
  double width_m = 1.0;
  double height_m = 1.0;
  double bottom_z_m = 0.0;  ///< height of the lower border
};

PanelFrame common_frame(std::span<const ScanPicture> pictures);

/// Each panel is centred on its subject.
void draw_scan_panel(Markup& out, const ScanPicture& picture, const PanelFrame& frame, PictureUse use);

/// |measured - closed form| within the tolerance; empty when one of the three is not known.
std::optional<bool> agrees(const ScanPicture& picture);

}  // namespace hil::report
