#pragma once
// The world from above, to scale: north up, east right, a scale bar, axes in metres, a legend.

#include <string>

#include "runtime/report/html/svg.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

struct TopViewResult {
  std::vector<std::string> labels_without_space;  ///< names that the picture does not show
};

/// The page width at which the picture's text is readable.
enum class PictureWidth { page, phone };

/// Ignores shapes, tracks and points with coordinates that are not finite. Without content it draws an
/// empty frame of 100 m by 60 m around the origin.
TopViewResult draw_top_view(Markup& out, const TopView& view, PictureUse use,
                            PictureWidth width = PictureWidth::page);

}  // namespace hil::report
