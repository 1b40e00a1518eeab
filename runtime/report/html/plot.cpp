#include "runtime/report/html/plot.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "runtime/report/html/axis.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

using contribution::Plot;
using contribution::PlotAxis;
using contribution::Series;

constexpr double picture_width = 500.0;
constexpr double area_left = 58.0;
constexpr double area_right = 486.0;
constexpr double area_top = 26.0;  // below the name of the vertical axis
constexpr double area_height = 240.0;
constexpr double area_bottom = area_top + area_height;
constexpr double legend_row = 16.0;
constexpr std::size_t colours = 8;  // c0 to c7 of page_style.hpp

/// Beyond this, differences of two values and the decades between them would have no meaning in a picture.
constexpr double max_value = 1e100;

bool can_be_drawn(double value, const PlotAxis& axis) {
  return std::abs(value) <= max_value && (!axis.logarithmic || value >= 1.0 / max_value);
}

bool can_be_drawn(const std::array<double, 2>& point, const Plot& plot) {
  return can_be_drawn(point[0], plot.x) && can_be_drawn(point[1], plot.y);
}

/// The range of one coordinate over all drawn points; empty when there are none.
Interval extent(const Plot& plot, std::size_t coordinate) {
  Interval range{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
  for (const Series& series : plot.series) {
    for (const auto& point : series.points) {
      if (!can_be_drawn(point, plot)) continue;
      range.low = std::min(range.low, point[coordinate]);
      range.high = std::max(range.high, point[coordinate]);
    }
  }
  return range;
}

/// Wide enough for a scale, with a linear axis that begins at 0 if all is positive.
Interval axis_range(Interval range, const PlotAxis& axis) {
  if (axis.logarithmic) return rounded_decades(range);
  range.low = std::min(range.low, 0.0);
  const double length = range.high - range.low;
  return {range.low, range.high + (length > 0.0 ? 0.05 * length : 1.0)};
}

/// The smallest distance between the places of bars.
double bar_distance(const Plot& plot) {
  std::vector<double> places;
  for (const Series& series : plot.series)
    for (const auto& point : series.points)
      if (can_be_drawn(point, plot)) places.push_back(point[0]);
  std::ranges::sort(places);
  double distance = std::numeric_limits<double>::infinity();
  for (std::size_t i = 1; i < places.size(); ++i)
    if (places[i] > places[i - 1]) distance = std::min(distance, places[i] - places[i - 1]);
  return std::isfinite(distance) ? distance : 1.0;
}

/// Half a bar's distance beyond the first and the last one.
Interval bar_range(const Plot& plot) {
  const Interval range = extent(plot, 0);
  const double half = 0.5 * bar_distance(plot);
  return {range.low - half, range.high + half};
}

Interval bar_heights(const Plot& plot) {
  const Interval range = extent(plot, 1);
  return axis_range({range.low, std::max(range.high, 0.0)}, plot.y);
}

std::string axis_text(const PlotAxis& axis) {
  return axis.quantity + (axis.unit.empty() ? "" : ", " + axis.unit) +
         (axis.logarithmic ? " (logarithmic)" : "");
}

std::string tick_text(double value) {
  const double size = std::abs(value);
  if (size >= 1e5 || (size > 0.0 && size < 1e-3)) {
    const int exponent = static_cast<int>(std::floor(std::log10(size) + 1e-9));
    return shortest(std::round(value / std::pow(10.0, exponent) * 100.0) / 100.0) + "e" +
           std::to_string(exponent);
  }
  return shortest(std::round(value * 1e6) / 1e6);
}

class PlotDrawing {
 public:
  PlotDrawing(Markup& out, const Plot& plot)
      : out_(out),
        plot_(plot),
        x_range_(plot.bars ? bar_range(plot) : axis_range(extent(plot, 0), plot.x)),
        y_range_(plot.bars ? bar_heights(plot) : axis_range(extent(plot, 1), plot.y)),
        x_(kind_of(plot.x), x_range_, {area_left, area_right}),
        y_(kind_of(plot.y), y_range_, {area_bottom, area_top}) {}

  void draw(PictureUse use) {
    const double legend_top = area_bottom + 44.0;
    const std::size_t rows = (plot_.series.size() + 1) / 2;
    const double height = legend_top + legend_row * static_cast<double>(rows);
    open_svg(out_, picture_width, height, plot_.title, use);
    draw_axes();
    for (std::size_t i = 0; i < plot_.series.size(); ++i) {
      plot_.bars ? draw_bars(plot_.series[i], i) : draw_series(plot_.series[i], i);
      draw_legend(plot_.series[i].name, i, legend_top);
    }
    out_.close();
  }

 private:
  static Scale::Kind kind_of(const PlotAxis& axis) {
    return axis.logarithmic ? Scale::Kind::logarithmic : Scale::Kind::linear;
  }
  static std::vector<double> ticks_of(const PlotAxis& axis, Interval range) {
    return axis.logarithmic ? logarithmic_ticks(range) : linear_ticks(range, 8);
  }

  void draw_axes() {
    double free_above = std::numeric_limits<double>::infinity();
    for (const double tick : ticks_of(plot_.y, y_range_)) {
      const double at = y_(tick);
      svg_line(out_, "grid", {area_left, at}, {area_right, at});
      if (at + 6.0 > free_above) continue;
      svg_text(out_, "", {area_left - 6.0, at + 4.0}, "end", tick_text(tick));
      free_above = at - 6.0;
    }
    double free_from = 0.0;
    for (const double tick : ticks_of(plot_.x, x_range_)) {
      const double at = x_(tick);
      svg_line(out_, "grid", {at, area_top}, {at, area_bottom});
      const std::string text = tick_text(tick);
      const double half = text_width(text, 11.0) / 2.0;
      if (at - half < free_from || at + half > picture_width) continue;
      svg_text(out_, "", {at, area_bottom + 16.0}, "middle", text);
      free_from = at + half + 4.0;
    }
    svg_line(out_, "axis", {area_left, area_bottom}, {area_right, area_bottom});
    svg_line(out_, "axis", {area_left, area_top}, {area_left, area_bottom});
    svg_text(out_, "", {(area_left + area_right) / 2.0, area_bottom + 32.0}, "middle", axis_text(plot_.x));
    svg_text(out_, "strong label", {area_left, area_top - 10.0}, "start", "\u2191 " + axis_text(plot_.y));
  }

  void draw_series(const Series& series, std::size_t number) {
    const std::string colour = " c" + std::to_string(number % colours);
    std::vector<Pixel> line, dots;
    const auto end_line = [&] {
      if (const std::string path = svg_path(line, false); !path.empty())
        out_.leaf("path", {{"class", "series" + colour}, {"d", path}});
      line.clear();
    };
    for (const auto& point : series.points) {
      if (!can_be_drawn(point, plot_)) {
        end_line();
        continue;
      }
      line.push_back({x_(point[0]), y_(point[1])});
      dots.push_back(line.back());
    }
    end_line();
    if (!dots.empty()) out_.leaf("path", {{"class", "dots" + colour}, {"d", svg_dots(dots)}});
  }

  /// The series stand side by side on four fifths of the distance. A bar is a broad vertical line from 0.
  void draw_bars(const Series& series, std::size_t number) {
    const double distance = x_(x_range_.low + bar_distance(plot_)) - x_(x_range_.low);
    const auto count = static_cast<double>(plot_.series.size());
    const double width = 0.8 * distance / count;
    const double aside = (static_cast<double>(number) - 0.5 * (count - 1.0)) * width;
    std::string path;
    for (const auto& point : series.points) {
      if (!can_be_drawn(point, plot_)) continue;
      path += svg_path(
          std::array{Pixel{x_(point[0]) + aside, y_(0.0)}, Pixel{x_(point[0]) + aside, y_(point[1])}}, false);
    }
    if (path.empty()) return;
    out_.leaf("path", {{"class", "series c" + std::to_string(number % colours)},
                       {"style", "stroke-width:" + shortest(std::max(width, 0.5))},
                       {"d", path}});
  }

  void draw_legend(const std::string& name, std::size_t number, double top) {
    const double left = number % 2 == 0 ? area_left : (area_left + area_right) / 2.0;
    const std::size_t row = number / 2;
    const double at = top + legend_row * static_cast<double>(row);
    out_.leaf("path", {{"class", "cloud c" + std::to_string(number % colours)},
                       {"style", "stroke-width:8"},
                       {"d", svg_dots(std::array{Pixel{left + 4.0, at}})}});
    svg_text(out_, "", {left + 14.0, at + 4.0}, "start", name);
  }

  Markup& out_;
  const Plot& plot_;
  Interval x_range_, y_range_;
  Scale x_, y_;
};

}  // namespace

void draw_plot(Markup& out, const Plot& plot, PictureUse use) {
  const bool has_points = std::ranges::any_of(plot.series, [&](const Series& series) {
    return std::ranges::any_of(series.points, [&](const auto& point) { return can_be_drawn(point, plot); });
  });
  if (has_points) {
    PlotDrawing(out, plot).draw(use);
    return;
  }
  if (use == PictureUse::inline_in_page) {
    out.element("p", {{"class", "soft small"}}, "No points.");
    return;
  }
  open_svg(out, picture_width, 30.0, plot.title, use);
  svg_text(out, "", {area_left, 20.0}, "start", "No points.");
  out.close();
}

}  // namespace hil::report
