#pragma once
// The frame of all pictures: a drawing area in pixels that scales with the page, and the classes of
// page_style.hpp.

#include <span>
#include <string>
#include <vector>

#include "runtime/report/markup.hpp"

namespace hil::report {

/// A place in a picture: x to the right, y down.
struct Pixel {
  double x = 0.0;
  double y = 0.0;
};

/// Standalone pictures contain a style sheet; inline ones use that of the page.
enum class PictureUse { inline_in_page, standalone_file };

/// Opens <svg>; the caller closes it.
void open_svg(Markup& out, double width, double height, const std::string& description, PictureUse use);

void svg_line(Markup& out, const char* css_class, Pixel from, Pixel to);
/// `anchor`: "start", "middle" or "end".
void svg_text(Markup& out, const char* css_class, Pixel at, const char* anchor, const std::string& text);
/// A path through pixel positions; empty for fewer than two points.
std::string svg_path(std::span<const Pixel> pixels, bool closed);
/// All dots as one path (stroke-linecap makes them round). Positions are rounded to a quarter of a pixel;
/// equal ones are drawn once.
std::string svg_dots(std::span<const Pixel> pixels);

/// An upper estimate of a text's width in a proportional font.
double text_width(const std::string& text, double font_size);

}  // namespace hil::report
