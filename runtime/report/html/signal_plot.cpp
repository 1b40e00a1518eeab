#include "runtime/report/html/signal_plot.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

#include "runtime/report/html/signal_lanes.hpp"
#include "runtime/report/html/signal_panels.hpp"
#include "runtime/report/html/signal_path.hpp"
#include "runtime/report/quantities.hpp"
#include "runtime/report/text_safety.hpp"

namespace hil::report {
namespace {

// Pixels.
constexpr double file_width = 1000.0;
constexpr double lane_height = 28.0;
constexpr double bar_height = 8.0;
constexpr double name_height = 16.0;
constexpr double panel_gap = 12.0;
constexpr double axis_height = 12.0;
constexpr double text_gap = 6.0;
constexpr std::size_t max_page_columns = 100;
constexpr std::size_t max_phone_columns = 23;
constexpr std::size_t max_lane_columns = 27;
constexpr std::size_t max_limit_columns = 10;
constexpr double limit_text_height = 12.0;
/// A line that is shorter than this part of the width has a dot at its begin.
constexpr double dots_per_width = 200.0;

/// The begin and the end of a name of ASCII that has more than `max_columns`.
std::string shortened(const std::string& name, std::size_t max_columns) {
  if (name.size() <= max_columns || name.size() != columns_of(name)) return name;
  const std::size_t kept = max_columns / 2;
  return name.substr(0, kept) + "…" + name.substr(name.size() - kept + 1);
}

/// With its unit.
std::string label_of(const SignalSeries& series, std::size_t max_columns) {
  std::string after = series.kind == SeriesKind::reference ? ", reference" : "";
  if (!series.unit.empty()) after += " [" + series.unit + ']';
  return shortened(series.name, max_columns - std::min(columns_of(after), max_columns / 2)) + after;
}

std::string classes_of(const PanelSeries& entry) {
  return "series c" + std::to_string(entry.colour) +
         (entry.series->kind == SeriesKind::signal ? "" : std::string(" ") + to_string(entry.series->kind));
}

/// A vertical line at an instant of an expectation.
struct Marker {
  const char* css_class = "";
  std::int64_t time_ns = 0;
};

std::vector<Marker> markers_of(const RunRecord& record, const SignalPlot& plot) {
  std::vector<Marker> markers;
  for (const std::uint32_t index : plot.expectations) {
    if (index >= record.expectations.size()) continue;
    const Expectation& expectation = record.expectations[index];
    if (expectation.worst_ns) markers.push_back({"least-margin", *expectation.worst_ns});
    if (expectation.met_ns) markers.push_back({"met", *expectation.met_ns});
    if (expectation.first_failure_ns) markers.push_back({"failure", *expectation.first_failure_ns});
  }
  std::erase_if(markers, [&](const Marker& marker) {
    return marker.time_ns < plot.begin_ns || marker.time_ns > plot.end_ns;
  });
  return markers;
}

class SignalPlotDrawing {
 public:
  SignalPlotDrawing(Markup& out, const RunRecord& record, const SignalPlot& plot)
      : out_(out),
        plot_(plot),
        panels_(panels_of(record.signal_plots, plot)),
        lanes_(lanes_of(record, plot)),
        markers_(markers_of(record, plot)) {
    scale_.begin_ns = plot.begin_ns;
    scale_.column_ns = std::max<std::int64_t>(1, plot.end_ns - plot.begin_ns);
    for (const Panel& panel : panels_) {
      for (const PanelSeries& entry : panel.series)
        if (entry.series->bucket_ns > 0)
          scale_.column_ns = std::min(scale_.column_ns, entry.series->bucket_ns);
    }
    width_ = std::max(1.0, x_at(scale_, plot.end_ns));
    for (const Event& event : record.events)
      if (is_in_plot(plot_, event.time_ns, event.time_ns) && !is_in_lane(event.time_ns))
        events_.push_back(event.time_ns);
    const auto repeated = std::ranges::unique(events_);
    events_.erase(repeated.begin(), repeated.end());
  }

  double height() const {
    double height = axis_height;
    height += lane_height * static_cast<double>(lanes_.shown.size() + (events_.empty() ? 0 : 1));
    if (lanes_.left_out > 0) height += name_height;
    for (const Panel& panel : panels_)
      height += name_height * static_cast<double>(panel.series.size() + panel.notes.size()) +
                panel.height_px + panel_gap;
    return height;
  }

  /// The attribute values by which the script knows the time of a horizontal coordinate.
  std::string begin_text() const { return std::to_string(scale_.begin_ns); }
  std::string column_text() const { return std::to_string(scale_.column_ns); }
  std::string width_text() const { return pixels(width_); }

  void draw() {
    for (const Lane& lane : lanes_.shown)
      draw_lane(lane);
    if (lanes_.left_out > 0) {
      text("lane", "0", 0.0, y_ + 10.0, "start",
           "and " + counted(lanes_.left_out, "more stimulus or fault", "more stimuli and faults"));
      y_ += name_height;
    }
    if (!events_.empty()) draw_events();
    for (const Panel& panel : panels_)
      draw_panel(panel);
    draw_time_axis();
  }

 private:
  /// A stimulus or a fault begins or ends.
  bool is_in_lane(std::int64_t time_ns) const {
    return std::ranges::any_of(lanes_.shown, [&](const Lane& lane) {
      return std::ranges::any_of(lane.spans, [&](const LaneSpan& one) {
        return one.span.begin_ns == time_ns || one.span.end_ns == time_ns;
      });
    });
  }

  void text(const char* css_class, const std::string& x, double dx, double y, const char* anchor,
            const std::string& content) {
    out_.element("text", {{"class", css_class}, {"x", x}, {"dx", dx}, {"y", y}, {"text-anchor", anchor}},
                 content);
  }
  /// Of a series, with its whole name for the pointer.
  void name(const char* css_class, const std::string& label, const std::string& whole) {
    out_.open("text", {{"class", css_class}, {"x", "0"}, {"dx", 24.0}, {"y", y_ + 12.0}});
    out_.text(label).element("title", whole).close();
  }
  void open_viewport(double height) {
    out_.open("svg", {{"class", "viewport"},
                      {"x", "0"},
                      {"y", y_},
                      {"width", "100%"},
                      {"height", height},
                      {"viewBox", "0 0 " + pixels(width_) + ' ' + pixels(viewport_height)},
                      {"preserveAspectRatio", "none"}});
  }
  /// Of the whole height of a viewport.
  void vertical(const std::string& css_class, std::int64_t time_ns) {
    out_.leaf("path", {{"class", css_class},
                       {"d", 'M' + pixels(x_at(scale_, time_ns)) + " 0v" + pixels(viewport_height)}});
  }

  /// Its name, and the viewport for its content, which the caller closes.
  void open_lane(const std::string& name) {
    text("lane", "0", 0.0, y_ + 10.0, "start", name);
    y_ += lane_height - bar_height - text_gap;
    open_viewport(bar_height);
    y_ += bar_height + text_gap;
  }

  void draw_lane(const Lane& lane) {
    open_lane(lane.kind + ' ' + shortened(lane.name, max_lane_columns) + lane.name_suffix);
    for (const LaneSpan& one : lane.spans) {
      if (!is_in_plot(plot_, one.span.begin_ns, one.span.end_ns)) continue;
      const double begin = std::max(0.0, x_at(scale_, one.span.begin_ns));
      const double end = std::min(width_, x_at(scale_, one.span.end_ns));
      out_.leaf("rect", {{"class", one.is_fault ? "active-fault" : "active-stimulus"},
                         {"x", begin},
                         {"width", std::max(end - begin, 0.0)},
                         {"height", viewport_height}});
    }
    out_.close();
  }

  void draw_events() {
    open_lane("events");
    for (const std::int64_t time_ns : events_)
      vertical("event", time_ns);
    out_.close();
  }

  void draw_panel(const Panel& panel) {
    for (const PanelSeries& entry : panel.series) {
      out_.leaf("path", {{"class", classes_of(entry)}, {"d", "M0 " + pixels(y_ + 8.0) + "h18"}});
      const std::string label = label_of(*entry.series, max_page_columns);
      const std::string on_phone = label_of(*entry.series, max_phone_columns);
      name(label == on_phone ? "strong" : "strong on-page", label, entry.series->name);
      if (label != on_phone) name("strong on-phone", on_phone, entry.series->name);
      text("value", "100%", signal_plot_right_gutter - text_gap, y_ + 12.0, "end", "");
      y_ += name_height;
    }
    for (const std::string& note : panel.notes) {
      text("note", "0", 0.0, y_ + 12.0, "start", note);
      y_ += name_height;
    }
    out_.leaf("rect", {{"class", "plot-area"}, {"y", y_}, {"width", "100%"}, {"height", panel.height_px}});
    const auto at = [&](double value) {
      return y_ + panel.height_px * (panel.range.high - value) / (panel.range.high - panel.range.low);
    };
    for (const PanelTick& tick : panel.ticks) {
      out_.leaf("line", {{"class", "grid"}, {"x2", "100%"}, {"y1", at(tick.value)}, {"y2", at(tick.value)}});
      text("", "0", -text_gap, at(tick.value) + 4.0, "end", tick.label);
    }
    ViewportScale scale = scale_;
    scale.range = panel.range;
    open_viewport(panel.height_px);
    for (const PanelSeries& entry : panel.series) {
      if (const std::string band = tolerance_path(*entry.series, scale); !band.empty())
        out_.leaf("path", {{"class", "band c" + std::to_string(entry.colour)}, {"d", band}});
    }
    for (const Marker& marker : markers_)
      vertical(std::string("marker-") + marker.css_class, marker.time_ns);
    for (const double limit : panel.limits) {
      if (limit >= panel.range.low && limit <= panel.range.high)
        out_.leaf("path", {{"class", "limit"},
                           {"d", "M0 " + std::to_string(y_at(scale, limit)) + 'h' + pixels(width_)}});
    }
    for (const PanelSeries& entry : panel.series)
      draw_series(entry, panel, scale);
    draw_instants(panel, scale);
    out_.close();
    if (!panel.is_known)
      text("", "50%", 0.0, y_ + panel.height_px / 2.0 + 4.0, "middle", "no value is known here");
    draw_limit_texts(panel);
    y_ += panel.height_px + panel_gap;
  }

  void draw_series(const PanelSeries& entry, const Panel& panel, const ViewportScale& scale) {
    nlohmann::json names = nlohmann::json::array();
    for (const NamedValue& named : entry.series->named_values)
      names.push_back({named.value, valid_utf8(named.name)});
    out_.leaf("path", {{"class", classes_of(entry)},
                       {"d", signal_path(*entry.series, scale, panel.is_discrete)},
                       {"data-low", to_ascii(shortest(panel.range.low))},
                       {"data-high", to_ascii(shortest(panel.range.high))},
                       {"data-steps", panel.is_discrete ? "1" : "0"},
                       {"data-names", names.dump()}});
    if (const std::string dots = dots_path(*entry.series, scale, width_ / dots_per_width); !dots.empty())
      out_.leaf("path", {{"class", "single c" + std::to_string(entry.colour)}, {"d", dots}});
  }

  /// Each tolerance as a vertical bar, and the value as a dot on it.
  void draw_instants(const Panel& panel, const ViewportScale& scale) {
    std::string values, tolerances;
    for (const PanelInstant& instant : panel.instants) {
      if (!is_in_plot(plot_, instant.time_ns, instant.time_ns)) continue;
      const std::string x = 'M' + pixels(x_at(scale, instant.time_ns)) + ' ';
      const long upper = y_at(scale, instant.value + instant.tolerance);
      const long lower = y_at(scale, instant.value - instant.tolerance);
      if (lower > upper) tolerances += x + std::to_string(upper) + 'v' + std::to_string(lower - upper);
      values += x + std::to_string(y_at(scale, instant.value)) + "h0";
    }
    if (!tolerances.empty()) out_.leaf("path", {{"class", "tolerance"}, {"d", tolerances}});
    if (!values.empty()) out_.leaf("path", {{"class", "expected"}, {"d", values}});
  }

  /// In the right gutter, from the top down, none over another one.
  void draw_limit_texts(const Panel& panel) {
    std::vector<double> limits = panel.limits;
    std::ranges::sort(limits, std::greater<>());
    double lowest = y_ - limit_text_height;
    for (const double limit : limits) {
      const std::string& unit = panel.series.front().series->unit;
      std::string label = quantity_text(limit, unit);
      if (columns_of(label) > max_limit_columns) label = quantity_text(limit, "");
      if (limit > panel.range.high) label = "↑ " + label;
      if (limit < panel.range.low) label = "↓ " + label;
      const double share = (panel.range.high - limit) / (panel.range.high - panel.range.low);
      const double y = y_ + panel.height_px * std::clamp(share, 0.0, 1.0);
      lowest = std::max(y, lowest + limit_text_height);
      text("limit-text", "100%", text_gap, lowest + 4.0, "start", label);
    }
  }

  void draw_time_axis() {
    const Interval seconds{static_cast<double>(plot_.begin_ns) / 1e9,
                           static_cast<double>(plot_.end_ns) / 1e9};
    out_.open("g", {{"class", "time-axis"}, {"data-y", pixels(y_)}});
    draw_time_labels(seconds);
    out_.close();
  }

  /// None for a run that ended before the plot begins.
  void draw_time_labels(Interval seconds) {
    if (!(seconds.high > seconds.low)) return;
    constexpr int max_labels = 11;
    const double step = linear_step(seconds.high - seconds.low, max_labels);
    const int decimals = decimals_of_step(step);
    int count = 0;
    for (const double time_s : linear_ticks(seconds, max_labels)) {
      const std::string x = pixels(100.0 * (time_s - seconds.low) / (seconds.high - seconds.low)) + '%';
      text(count++ % 2 == 0 ? "" : "spare", x, 0.0, y_ + 4.0, "middle", decimal(time_s, decimals) + " s");
    }
  }

  Markup& out_;
  const SignalPlot& plot_;
  std::vector<Panel> panels_;
  const Lanes lanes_;
  std::vector<Marker> markers_;
  ViewportScale scale_;
  double width_ = 1.0;                ///< of a viewport, in columns
  std::vector<std::int64_t> events_;  ///< instants of those that no lane shows
  double y_ = 0.0;                    ///< of what is drawn next
};

}  // namespace

void draw_signal_plot(Markup& out, const RunRecord& record, const SignalPlot& plot, PictureUse use) {
  SignalPlotDrawing drawing(out, record, plot);
  const std::string description = "signals over run time: " + plot.title;
  if (use == PictureUse::inline_in_page) {
    out.open("svg", {{"class", "signal-plot"},
                     {"height", drawing.height()},
                     {"role", "img"},
                     {"aria-label", description},
                     {"data-begin", drawing.begin_text()},
                     {"data-column", drawing.column_text()},
                     {"data-width", drawing.width_text()},
                     {"data-height", pixels(viewport_height)}});
    drawing.draw();
    out.close();
    return;
  }
  constexpr double title_height = 30.0;
  open_svg(out, file_width, drawing.height() + title_height, description, use);
  svg_text(out, "strong", {signal_plot_left_gutter, 18.0}, "start", plot.title);
  out.open("svg", {{"x", signal_plot_left_gutter},
                   {"y", title_height},
                   {"width", file_width - signal_plot_left_gutter - signal_plot_right_gutter},
                   {"height", drawing.height()},
                   {"overflow", "visible"}});
  drawing.draw();
  out.close().close();
}

}  // namespace hil::report
