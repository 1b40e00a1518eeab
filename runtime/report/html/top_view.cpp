#include "runtime/report/html/top_view.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "runtime/report/html/axis.hpp"
#include "runtime/report/html/label_placement.hpp"
#include "runtime/report/html/world_window.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

constexpr double top = 8.0;
constexpr double axis_height = 40.0;
constexpr double legend_row = 20.0;

struct Layout {
  double width;
  double left;
  double plot_width;
  AspectLimits aspect;
  int x_ticks;
  const char* clip_id;
};

constexpr Layout page_layout{1040.0, 46.0, 980.0, {}, 12, "top-view-area"};
constexpr Layout phone_layout{360.0, 38.0, 314.0, {0.9, 1.5}, 5, "top-view-area-phone"};

/// An entry of the legend: a symbol and its meaning.
struct LegendEntry {
  const char* css_class;
  enum class Symbol { area, line, dot } symbol;
  const char* text;
};

constexpr std::array<std::pair<Layer, LegendEntry>, 7> layer_legend{{
    {Layer::road, {"road", LegendEntry::Symbol::area, "road"}},
    {Layer::marking, {"marking", LegendEntry::Symbol::area, "marking"}},
    {Layer::detector, {"detector", LegendEntry::Symbol::area, "detector loop"}},
    {Layer::structure, {"static", LegendEntry::Symbol::area, "building, other body"}},
    {Layer::pole, {"pole", LegendEntry::Symbol::area, "pole"}},
    {Layer::vehicle, {"vehicle", LegendEntry::Symbol::area, "vehicle"}},
    {Layer::ego, {"ego", LegendEntry::Symbol::area, "ego"}},
}};

std::vector<Pixel> on_screen(const Track& track, const WorldToPixels& place) {
  std::vector<PointM> points;
  for (const TrackPoint& point : track.points)
    points.push_back({point.x_m, point.y_m});
  return place(points);
}

bool is_inside(const ViewBox& box, const PointM& point) {
  return point.x_m >= box.minimum.x_m && point.x_m <= box.maximum.x_m && point.y_m >= box.minimum.y_m &&
         point.y_m <= box.maximum.y_m;
}

/// The points inside the window, as dots.
std::string dots(std::vector<PointM> points, const ViewBox& window, const WorldToPixels& place) {
  std::erase_if(points, [&](const PointM& point) { return !is_inside(window, point); });
  return svg_dots(place(points));
}

/// The track's positions at whole seconds of run time.
std::vector<PointM> each_second(const Track& track) {
  constexpr std::int64_t second_ns = 1'000'000'000;
  std::vector<PointM> points;
  for (std::size_t index = 0; index < track.points.size(); ++index) {
    const std::int64_t second = track.points[index].time_ns / second_ns;
    if (index == 0 || second != track.points[index - 1].time_ns / second_ns) {
      points.push_back({track.points[index].x_m, track.points[index].y_m});
    }
  }
  return points;
}

std::vector<PointM> outline_of(const FieldOfView& fan) {
  constexpr int steps = 48;
  std::vector<PointM> outline{fan.origin};
  for (int step = 0; step <= steps; ++step) {
    const double share = static_cast<double>(step) / steps;
    const double angle = fan.first_direction_rad + share * (fan.last_direction_rad - fan.first_direction_rad);
    outline.push_back(
        {fan.origin.x_m + fan.range_m * std::cos(angle), fan.origin.y_m + fan.range_m * std::sin(angle)});
  }
  return outline;
}

class Drawing {
 public:
  Drawing(Markup& out, const TopView& view, const Layout& layout)
      : out_(out),
        view_(view),
        layout_(layout),
        window_(window_of(view, layout.aspect)),
        place_(window_, layout.left, top, layout.plot_width),
        labels_(place_.area()) {
    collect_legend();
  }

  TopViewResult draw(PictureUse use) {
    const PixelBox& area = place_.area();
    open_svg(out_, layout_.width, area.bottom + axis_height + legend_height(),
             "The world from above at " + instant(view_.time_ns), use);
    clip();
    rectangle("land", area);
    out_.open("g", {{"clip-path", "url(#" + std::string(layout_.clip_id) + ")"}});
    shapes(Layer::ground, Layer::marking);
    for (const Track& track : view_.tracks)
      draw_track(track);
    fan();
    shapes(Layer::detector, Layer::ego);
    hits();
    out_.close();
    axes();
    rectangle("plot-area", area);
    scale_bar();
    compass();
    TopViewResult result{place_labels()};
    legend();
    out_.close();
    return result;
  }

 private:
  void rectangle(const char* css_class, const PixelBox& box) {
    out_.leaf("rect", {{"class", css_class},
                       {"x", box.left},
                       {"y", box.top},
                       {"width", box.right - box.left},
                       {"height", box.bottom - box.top}});
  }

  void clip() {
    out_.open("clipPath", {{"id", layout_.clip_id}});
    rectangle("", place_.area());
    out_.close();
  }

  void shapes(Layer first, Layer last) {
    for (auto layer = first; layer <= last; layer = static_cast<Layer>(static_cast<int>(layer) + 1)) {
      for (const Shape& shape : view_.shapes) {
        if (shape.layer == layer) draw_shape(shape);
      }
    }
  }

  void draw_shape(const Shape& shape) {
    const std::vector<PointM> visible = clipped(shape.footprint, window_);
    if (visible.size() < 3) return;
    const std::vector<Pixel> outline = place_(visible);
    out_.open("path", {{"class", to_string(shape.layer)}, {"d", svg_path(outline, true)}});
    if (!shape.label.empty()) out_.element("title", shape.label);
    out_.close();
    const bool solid =
        shape.layer == Layer::vehicle || shape.layer == Layer::ego || shape.layer == Layer::pole;
    if (solid) labels_.reserve(bounds_of(outline));
    const bool named = !shape.label.empty() && shape.layer != Layer::ground && shape.layer != Layer::marking;
    if (named) wanted_labels_.push_back({&shape, bounds_of(outline)});
  }

  void draw_track(const Track& track) {
    const std::vector<Pixel> path_px = on_screen(track, place_);
    for (const Pixel& at : path_px)
      labels_.reserve({at.x - 3.0, at.y - 3.0, at.x + 3.0, at.y + 3.0});
    const std::string path = svg_path(path_px, false);
    if (path.empty()) return;
    out_.open("path", {{"class", track.ego ? "track track-ego" : "track"}, {"d", path}});
    out_.element("title", track.name).close();
    out_.leaf("path", {{"class", track.ego ? "second second-ego" : "second"},
                       {"d", dots(each_second(track), window_, place_)}});
  }

  void fan() {
    if (!view_.fan) return;
    const std::vector<PointM> visible = clipped(outline_of(*view_.fan), window_);
    if (visible.size() >= 3) out_.leaf("path", {{"class", "fan"}, {"d", svg_path(place_(visible), true)}});
  }

  void hits() {
    std::vector<PointM> points;
    for (const SensorPoint& point : view_.scan_points)
      points.push_back({point.x_m, point.y_m});
    if (!points.empty()) out_.leaf("path", {{"class", "hits"}, {"d", dots(points, window_, place_)}});
  }

  void axes() {
    const PixelBox& area = place_.area();
    for (const double x_m : linear_ticks({window_.minimum.x_m, window_.maximum.x_m}, layout_.x_ticks)) {
      const double at = place_({x_m, 0.0}).x;
      svg_line(out_, "axis", {at, area.bottom}, {at, area.bottom + 4.0});
      svg_text(out_, "", {at, area.bottom + 16.0}, "middle", shortest(std::round(x_m * 1e6) / 1e6));
    }
    for (const double y_m : linear_ticks({window_.minimum.y_m, window_.maximum.y_m}, 8)) {
      const double at = place_({0.0, y_m}).y;
      svg_line(out_, "axis", {area.left - 4.0, at}, {area.left, at});
      svg_text(out_, "", {area.left - 7.0, at + 4.0}, "end", shortest(std::round(y_m * 1e6) / 1e6));
    }
    svg_text(out_, "", {area.right, area.bottom + 32.0}, "end", "x and y in metres");
  }

  void scale_bar() {
    const PixelBox& area = place_.area();
    const double length_m = linear_step((window_.maximum.x_m - window_.minimum.x_m) / 16.0, 2);
    const double length = length_m * place_.pixels_per_metre();
    const PixelBox plate{area.left + 10.0, area.bottom - 40.0, area.left + 34.0 + length, area.bottom - 10.0};
    rectangle("plate", plate);
    labels_.reserve(plate);
    const double from = plate.left + 12.0;
    const double line = plate.bottom - 9.0;
    svg_line(out_, "rule", {from, line}, {from + length, line});
    svg_line(out_, "rule", {from, line - 4.0}, {from, line + 4.0});
    svg_line(out_, "rule", {from + length, line - 4.0}, {from + length, line + 4.0});
    svg_text(out_, "strong", {from + length / 2.0, line - 7.0}, "middle", shortest(length_m) + " m");
  }

  void compass() {
    const PixelBox& area = place_.area();
    const PixelBox plate{area.right - 86.0, area.top + 10.0, area.right - 10.0, area.top + 74.0};
    rectangle("plate", plate);
    labels_.reserve(plate);
    const Pixel origin{plate.left + 16.0, plate.bottom - 16.0};
    svg_line(out_, "rule", origin, {origin.x, plate.top + 16.0});
    svg_line(out_, "rule", origin, {origin.x + 32.0, origin.y});
    const std::array up{Pixel{origin.x - 4.0, plate.top + 17.0}, Pixel{origin.x, plate.top + 8.0},
                        Pixel{origin.x + 4.0, plate.top + 17.0}};
    const std::array right{Pixel{origin.x + 31.0, origin.y - 4.0}, Pixel{origin.x + 40.0, origin.y},
                           Pixel{origin.x + 31.0, origin.y + 4.0}};
    out_.leaf("path", {{"class", "arrow"}, {"d", svg_path(up, true)}});
    out_.leaf("path", {{"class", "arrow"}, {"d", svg_path(right, true)}});
    svg_text(out_, "strong", {origin.x + 8.0, plate.top + 18.0}, "start", "y north");
    svg_text(out_, "strong", {origin.x + 8.0, origin.y - 8.0}, "start", "x east");
  }

  std::vector<std::string> place_labels() {
    // Moving bodies get their labels first.
    std::ranges::stable_sort(wanted_labels_,
                             [](const auto& a, const auto& b) { return a.shape->layer > b.shape->layer; });
    std::vector<std::string> unplaced;
    for (const WantedLabel& wanted : wanted_labels_) {
      const auto at = labels_.place(wanted.shape->label, wanted.around);
      if (at) {
        svg_text(out_, "label", *at, "start", wanted.shape->label);
      } else {
        unplaced.push_back(wanted.shape->label);
      }
    }
    return unplaced;
  }

  void collect_legend() {
    using enum LegendEntry::Symbol;
    for (const auto& [layer, entry] : layer_legend) {
      const auto of_layer = [wanted = layer](const Shape& shape) { return shape.layer == wanted; };
      if (std::ranges::any_of(view_.shapes, of_layer)) legend_.push_back(entry);
    }
    if (!view_.tracks.empty()) legend_.push_back({"track", line, "track of a vehicle"});
    if (std::ranges::any_of(view_.tracks, &Track::ego))
      legend_.push_back({"track track-ego", line, "track of the ego"});
    if (!view_.tracks.empty()) legend_.push_back({"second", dot, "position each second"});
    if (view_.fan) legend_.push_back({"fan", area, "field of view"});
    if (!view_.scan_points.empty()) legend_.push_back({"hits", dot, "scan hits"});
  }

  static double entry_width(const LegendEntry& entry) { return 36.0 + text_width(entry.text, 11.0); }

  /// Calls draw(entry, x, row) for each entry, rows filled from the left.
  template <class Draw>
  void flow_legend(Draw draw) const {
    double x = layout_.left;
    int row = 0;
    for (const LegendEntry& entry : legend_) {
      if (x > layout_.left && x + entry_width(entry) > layout_.left + layout_.plot_width) {
        x = layout_.left;
        ++row;
      }
      draw(entry, x, row);
      x += entry_width(entry);
    }
  }

  double legend_height() const {
    int rows = 0;
    flow_legend([&](const LegendEntry&, double, int row) { rows = row + 1; });
    return rows * legend_row;
  }

  void legend() {
    const double first_row = place_.area().bottom + axis_height;
    flow_legend([&](const LegendEntry& entry, double x, int row) {
      const double y = first_row + row * legend_row;
      using enum LegendEntry::Symbol;
      switch (entry.symbol) {
        case area:
          rectangle(entry.css_class, {x, y, x + 16.0, y + 10.0});
          break;
        case line:
          svg_line(out_, entry.css_class, {x, y + 5.0}, {x + 16.0, y + 5.0});
          break;
        case dot:
          out_.leaf("path",
                    {{"class", entry.css_class}, {"d", svg_dots(std::array{Pixel{x + 8.0, y + 5.0}})}});
          break;
      }
      svg_text(out_, "", {x + 22.0, y + 9.0}, "start", entry.text);
    });
  }

  struct WantedLabel {
    const Shape* shape;
    PixelBox around;
  };

  Markup& out_;
  const TopView& view_;
  const Layout& layout_;
  ViewBox window_;
  WorldToPixels place_;
  LabelPlacement labels_;
  std::vector<WantedLabel> wanted_labels_;
  std::vector<LegendEntry> legend_;
};

}  // namespace

TopViewResult draw_top_view(Markup& out, const TopView& view, PictureUse use, PictureWidth width) {
  return Drawing(out, view, width == PictureWidth::phone ? phone_layout : page_layout).draw(use);
}

}  // namespace hil::report
