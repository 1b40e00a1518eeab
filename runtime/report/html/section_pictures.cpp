#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include "runtime/report/html/histogram_chart.hpp"
#include "runtime/report/html/plot.hpp"
#include "runtime/report/html/point_picture.hpp"
#include "runtime/report/html/sections.hpp"
#include "runtime/report/html/table.hpp"
#include "runtime/report/html/top_view.hpp"
#include "runtime/report/html/world_window.hpp"
#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

Cell cell_of(const contribution::Column& column, const contribution::Cell& cell) {
  static constexpr std::array css_classes{"", "tone good nowrap", "tone bad nowrap"};
  std::string text = cell.text;
  if (column.numeric && !std::isfinite(cell.number)) {
    text = dash;
  } else if (column.numeric) {
    text = decimal(cell.number, column.decimals) + (column.unit.empty() ? "" : ' ' + column.unit);
  }
  return {std::move(text), css_classes[static_cast<std::size_t>(cell.mark)]};
}

void draw_table(Markup& out, const contribution::Table& content) {
  std::vector<Column> columns;
  for (const contribution::Column& column : content.columns)
    columns.push_back({column.title, column.numeric});
  Table table(out, std::move(columns));
  for (const auto& content_row : content.rows) {
    std::vector<Cell> cells;
    for (std::size_t i = 0; i < content.columns.size(); ++i)
      cells.push_back(i < content_row.size() ? cell_of(content.columns[i], content_row[i]) : Cell(""));
    table.row(cells);
  }
  table.end();
}

/// The names of the entities in the pictures, with their colours.
void cloud_legend(Markup& out, const std::vector<Picture>& pictures) {
  std::set<std::pair<std::uint32_t, std::string>> bodies;
  for (const Picture& picture : pictures) {
    for (const SensorPoint& point : picture.points) {
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

void draw_images(Markup& out, const std::vector<contribution::ShownImage>& images) {
  if (images.empty()) return;
  out.open("div", {{"class", "panels"}});
  for (const contribution::ShownImage& image : images) {
    out.open("figure").element("h3", image.title);
    out.leaf("img", {{"alt", image.title}, {"src", "data:image/png;base64," + image.png}});
    out.element("figcaption", image.caption).close();
  }
  out.close();
}

void draw_plots(Markup& out, const std::vector<contribution::Plot>& plots) {
  if (plots.empty()) return;
  out.open("div", {{"class", "panels"}});
  for (const contribution::Plot& plot : plots) {
    out.open("figure").element("h3", plot.title);
    draw_plot(out, plot, PictureUse::inline_in_page);
    out.element("figcaption", plot.caption).close();
  }
  out.close();
}

void response_card(Markup& out, const ResponseTime& response) {
  const Quantiles quantiles = quantiles_of(response.samples_ns);
  const auto late =
      std::ranges::count_if(response.samples_ns, [&](std::int64_t ns) { return ns > response.limit_ns; });
  out.open("div", {{"class", "card"}}).element("h3", response.name);
  std::string summary = counted(quantiles.samples, "answer", "answers");
  if (quantiles.samples > 0) {
    summary += ": median " + measured_time(quantiles.p50) + ", p99 " + measured_time(quantiles.p99) +
               ", longest " + measured_time(quantiles.max);
  }
  if (response.limit_ns > 0) {
    summary += "; limit " + chosen_time(response.limit_ns) + ", " +
               count_text(static_cast<std::uint64_t>(late)) + " past it";
  }
  out.element("p", {{"class", "small"}}, summary + "; unanswered: " + count_text(response.unanswered) + ".");
  if (quantiles.samples > 0) {
    HistogramChart chart{"response time", Scale::Kind::linear, {}};
    if (response.limit_ns > 0) chart.marks.push_back({"limit", response.limit_ns, "mark-limit"});
    chart.marks.push_back({"max", quantiles.max, "mark-max"});
    chart.marks.push_back({"p99", quantiles.p99, "mark-p99"});
    chart.marks.push_back({"p50", quantiles.p50, "mark-p50"});
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
        "A scan hit is where a beam met a body at the beam's instant, so the hits of a moving body need not "
        "lie on "
        "its outline here. ";
  }
  if (!result.labels_without_space.empty()) {
    caption += "Names without space in the picture: ";
    for (const std::string& name : result.labels_without_space) {
      caption += (&name == result.labels_without_space.data() ? "" : ", ") + name;
    }
    caption += '.';
  }
  if (!caption.empty()) out.element("figcaption", caption);
  out.close();
}

void views_section(Markup& out, const RunRecord& record) {
  if (record.views.empty()) return;
  out.element("h2", "The world at " + instant(record.views.front().time_ns));
  out.open("div", {{"class", "card"}}).open("div", {{"class", "panels"}});
  for (const View& view : record.views) {
    out.open("figure").element("h3", "From " + view.name);
    out.leaf("img", {{"alt", "the world, seen from " + view.name},
                     {"src", "data:image/png;base64," + view.image_png}});
    std::string caption = "Exposure value " + decimal(view.exposure_value, 1);
    if (view.in_daylight) caption += ", in daylight, since it sees no light of the world";
    if (view.lights_overflow) caption += ", without some lights, since the world has too many";
    if (view.incomplete_pixels > 0)
      caption += ", " + counted(view.incomplete_pixels, "pixel lacks", "pixels lack") + " light";
    out.element("figcaption", caption + (view.file.empty() ? "." : ", " + view.file + ".")).close();
  }
  out.close().close();
}

void contributed_sections(Markup& out, const RunRecord& record) {
  for (const Section& section : record.sections) {
    out.element("h2", section.title);
    out.open("div", {{"class", "card"}});
    if (!section.text.empty()) out.element("p", {{"class", "small soft"}}, section.text);
    draw_images(out, section.images);
    if (!section.pictures.empty()) {
      out.open("div", {{"class", "panels"}});
      const PictureFrame frame = common_frame(section.pictures);
      for (const Picture& picture : section.pictures) {
        out.open("figure").element("h3", picture.title);
        draw_point_picture(out, picture, frame, PictureUse::inline_in_page);
        out.element("figcaption", picture.caption).close();
      }
      out.close();
      cloud_legend(out, section.pictures);
    }
    draw_plots(out, section.plots);
    for (const contribution::Table& table : section.tables)
      draw_table(out, table);
    out.close();
  }
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
