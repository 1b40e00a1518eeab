#include "runtime/report/html/svg.hpp"

#include <cmath>
#include <set>
#include <utility>

#include "runtime/report/html/page_style.hpp"
#include "runtime/report/text_safety.hpp"

namespace hil::report {

void open_svg(Markup& out, double width, double height, const std::string& description, PictureUse use) {
  const std::string box = "0 0 " + pixels(width) + ' ' + pixels(height);
  if (use == PictureUse::inline_in_page) {
    out.open("svg", {{"viewBox", box}, {"role", "img"}, {"aria-label", description}});
    return;
  }
  out.open("svg", {{"xmlns", "http://www.w3.org/2000/svg"},
                   {"viewBox", box},
                   {"width", width},
                   {"height", height},
                   {"role", "img"},
                   {"aria-label", description}});
  out.open("style").raw(picture_style()).close();
  out.leaf("rect", {{"class", "paper"}, {"width", width}, {"height", height}});
}

void svg_line(Markup& out, const char* css_class, Pixel from, Pixel to) {
  out.leaf("line", {{"class", css_class}, {"x1", from.x}, {"y1", from.y}, {"x2", to.x}, {"y2", to.y}});
}

void svg_text(Markup& out, const char* css_class, Pixel at, const char* anchor, const std::string& text) {
  out.element("text", {{"class", css_class}, {"x", at.x}, {"y", at.y}, {"text-anchor", anchor}}, text);
}

std::string svg_path(std::span<const Pixel> points, bool closed) {
  if (points.size() < 2) return {};
  std::string path;
  for (const Pixel& point : points) {
    path += path.empty() ? 'M' : 'L';
    path += pixels(point.x) + ' ' + pixels(point.y);
  }
  if (closed) path += 'Z';
  return path;
}

std::string svg_dots(std::span<const Pixel> points) {
  std::set<std::pair<long, long>> quarters;
  for (const Pixel& point : points)
    quarters.emplace(std::lround(point.x * 4.0), std::lround(point.y * 4.0));
  std::string path;
  for (const auto& [x, y] : quarters) {
    path += 'M' + pixels(static_cast<double>(x) / 4.0) + ' ' + pixels(static_cast<double>(y) / 4.0) + "h0";
  }
  return path;
}

double text_width(const std::string& text, double font_size) {
  return 0.6 * font_size * static_cast<double>(columns_of(text));
}

}  // namespace hil::report
