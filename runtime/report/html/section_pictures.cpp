#include <algorithm>
#include <cmath>
#include <set>

#include "runtime/report/html/histogram_chart.hpp"
#include "runtime/report/html/scan_panel.hpp"
#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/table.hpp"
#include "runtime/report/html/top_view.hpp"
#include "runtime/report/html/world_window.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

std::string metres(double value_m) {
  return std::isfinite(value_m) ? decimal(value_m, 3) + " m" : std::string(dash);
}

void lengths_table(Markup& out, const std::vector<ScanPicture>& pictures) {
  Table table(out, {{"Case"},
                    {"True length", true},
                    {"Measured", true},
                    {"Closed form", true},
                    {"Difference", true},
                    {"Relative", true},
                    {"Allowed", true},
                    {"Result"}});
  for (const ScanPicture& picture : pictures) {
    const double difference_m = picture.measured_length_m - picture.closed_form_length_m;
    const std::optional<bool> agreed = agrees(picture);
    table.row({picture.title,
               metres(picture.true_length_m),
               metres(picture.measured_length_m),
               metres(picture.closed_form_length_m),
               metres(difference_m),
               percent(difference_m / picture.closed_form_length_m, 2),
               std::isfinite(picture.tolerance_m) ? "± " + metres(picture.tolerance_m) : std::string(dash),
               {!agreed   ? dash
                : *agreed ? "✓ agrees"
                          : "✗ differs",
                !agreed   ? ""
                : *agreed ? "tone good nowrap"
                          : "tone bad nowrap"}});
  }
  table.end();
}

/// The names of the bodies in the panels, with their colours.
void cloud_legend(Markup& out, const std::vector<ScanPicture>& pictures) {
  std::set<std::pair<std::uint32_t, std::string>> bodies;
  for (const ScanPicture& picture : pictures) {
    for (const ScanPoint& point : picture.points) {
      if (point.entity < picture.entities.size())
        bodies.emplace(point.entity, picture.entities[point.entity]);
    }
  }
  if (bodies.empty()) return;
  out.open("div", {{"class", "legend"}});
  for (const auto& [number, name] : bodies) {
    out.open("span").open("svg", {{"viewBox", "0 0 12 12"}, {"aria-hidden", "true"}});
    out.leaf(
        "path",
        {{"class", "cloud c" + std::to_string(number % 8)}, {"style", "stroke-width:8"}, {"d", "M6 6h0"}});
    out.close().text(name).close();
  }
  out.close();
}

void response_card(Markup& out, const ResponseTime& response) {
  const Quantiles spread = spread_of(response.samples_ns);
  const auto late =
      std::ranges::count_if(response.samples_ns, [&](std::int64_t ns) { return ns > response.limit_ns; });
  out.open("div", {{"class", "card"}}).element("h3", response.name);
  std::string summary = counted(spread.samples, "answer", "answers");
  if (spread.samples > 0) {
    summary += ": median " + measured_time(spread.p50) + ", p99 " + measured_time(spread.p99) + ", longest " +
               measured_time(spread.max);
  }
  if (response.limit_ns > 0) {
    summary += "; limit " + chosen_time(response.limit_ns) + ", " +
               count_text(static_cast<std::uint64_t>(late)) + " past it";
  }
  out.element("p", {{"class", "small"}}, summary + "; unanswered: " + count_text(response.unanswered) + ".");
  if (spread.samples > 0) {
    HistogramChart chart{"response time", Scale::Kind::linear, {}};
    if (response.limit_ns > 0) chart.marks.push_back({"limit", response.limit_ns, "mark-limit"});
    chart.marks.push_back({"max", spread.max, "mark-max"});
    chart.marks.push_back({"p99", spread.p99, "mark-p99"});
    chart.marks.push_back({"p50", spread.p50, "mark-p50"});
    draw_histogram(out, histogram_of(response.samples_ns, 40), chart);
  }
  out.close();
}

}  // namespace

void top_view_section(Markup& out, const RunRecord& record) {
  if (!record.top_view || !has_content(*record.top_view)) return;
  out.element("h2", "The world from above at " + instant(record.top_view->time_ns));
  out.open("figure", {{"class", "card"}});
  out.open("div", {{"class", "scroll wide on-page"}});
  const TopViewResult result = draw_top_view(out, *record.top_view, PictureUse::inline_in_page);
  out.close().open("div", {{"class", "on-phone"}});
  draw_top_view(out, *record.top_view, PictureUse::inline_in_page, PictureWidth::phone);
  out.close();
  std::string caption;
  if (!record.top_view->scan_points.empty()) {
    caption =
        "Scan hits lie where each beam met a body at the beam's own instant, so those on a moving body need "
        "not lie on its outline here. ";
  }
  if (!result.labels_without_room.empty()) {
    caption += "No room for the names of: ";
    for (const std::string& name : result.labels_without_room) {
      caption += (&name == result.labels_without_room.data() ? "" : ", ") + name;
    }
    caption += '.';
  }
  if (!caption.empty()) out.element("figcaption", caption);
  out.close();
}

void scan_section(Markup& out, const RunRecord& record) {
  const auto& pictures = record.scan_comparison;
  if (pictures.empty()) return;
  out.element("h2", "What the scanner sees of a moving car");
  out.open("div", {{"class", "card"}});
  out.element("p", {{"class", "small soft"}},
              "Points of one body as seen from the scanner, all panels to one scale. Each beam has its own "
              "instant, so a body "
              "that moves with the turning beam looks longer than it is and one that moves against it "
              "shorter. The dashed "
              "frame is the body's true length; the closed form follows from the two instants at which the "
              "beam meets its "
              "front and its rear.");
  out.open("div", {{"class", "panels"}});
  const PanelFrame frame = common_frame(pictures);
  for (const ScanPicture& picture : pictures) {
    out.open("figure").element("h3", picture.title);
    draw_scan_panel(out, picture, frame, PictureUse::inline_in_page);
    out.element("figcaption", picture.caption).close();
  }
  out.close();
  cloud_legend(out, pictures);
  lengths_table(out, pictures);
  out.close();
}

void response_section(Markup& out, const RunRecord& record) {
  if (record.response_times.empty()) return;
  out.element("h2", "Response times");
  out.open("div", {{"class", "pair"}});
  for (const ResponseTime& response : record.response_times)
    response_card(out, response);
  out.close();
}

}  // namespace hil::report
