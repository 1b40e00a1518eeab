// The charts of the report: axes, histograms, labels, the top view, pictures of scans.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <sstream>

#include "runtime/report/html/axis.hpp"
#include "runtime/report/html/histogram_chart.hpp"
#include "runtime/report/html/label_placement.hpp"
#include "runtime/report/html/plot.hpp"
#include "runtime/report/html/point_picture.hpp"
#include "runtime/report/html/top_view.hpp"
#include "runtime/report/html/world_window.hpp"
#include "sample_record.hpp"
#include "strict_xml.hpp"

namespace hil::report {
namespace {

using test::parse_strictly;
using test::XmlElement;

constexpr std::int64_t max_int64 = std::numeric_limits<std::int64_t>::max();

double number(const XmlElement& element, const char* attribute) {
  return std::stod(element.attributes.at(attribute));
}

double picture_width(const XmlElement& svg) {
  double width = 0.0;
  std::sscanf(svg.attributes.at("viewBox").c_str(), "0 0 %lf", &width);
  return width;
}

/// No text extends beyond the picture, by an upper estimate of its width.
void expect_text_inside(const XmlElement& svg) {
  const double width = picture_width(svg);
  for (const XmlElement* text : svg.all("text")) {
    const double x = number(*text, "x");
    const double length = text_width(text->text, 11.0);
    const std::string& anchor = text->attributes.at("text-anchor");
    const double left = anchor == "start" ? x : anchor == "end" ? x - length : x - length / 2.0;
    EXPECT_GE(left, -0.5) << text->text;
    EXPECT_LE(left + length, width + 0.5) << text->text;
  }
}

std::string drawn(const Histogram& histogram, const HistogramChart& chart) {
  Markup out;
  draw_histogram(out, histogram, chart);
  return out.take();
}

TEST(Axis, TicksAreRoundAndInside) {
  EXPECT_EQ(linear_ticks({0.0, 10.0}, 6), (std::vector<double>{0, 2, 4, 6, 8, 10}));
  EXPECT_TRUE(linear_ticks({1.0, 1.0}, 6).empty());
  EXPECT_TRUE(linear_ticks({0.0, HUGE_VAL}, 6).empty());
  std::mt19937 random(3);
  std::uniform_real_distribution<double> exponent(-12.0, 12.0);
  for (int round = 0; round < 500; ++round) {
    const double low = std::pow(10.0, exponent(random));
    const Interval range{low, low * (1.0 + std::pow(10.0, exponent(random) / 4.0))};
    const auto ticks = linear_ticks(range, 7);
    EXPECT_LE(ticks.size(), 7U);
    EXPECT_GE(ticks.size(), 2U);
    for (const double tick : logarithmic_ticks(rounded_decades(range)))
      EXPECT_GT(tick, 0.0);
    EXPECT_GE(logarithmic_ticks(rounded_decades(range)).size(), 2U);
    EXPECT_LE(rounded_decades(range).low, range.low * 1.000001);
    EXPECT_GE(rounded_decades(range).high, range.high * 0.999999);
  }
}

TEST(HistogramChart, DrawsAnyRange) {
  for (const Histogram& empty : {Histogram{}, Histogram{{5, 6, 0}}})
    EXPECT_NE(drawn(empty, {"latency", Scale::Kind::linear, {}}).find("No samples."), std::string::npos);
  const std::vector<Histogram> histograms{
      {{0, 0, 1}},
      {{1, 1, 1}},
      {{5'000, 5'031, 1}},
      {{0, 0, 10'000'000'000}, {max_int64 - 1, max_int64, 1}},
      {{-50, -1, 3}, {0, 9, 2}},
      {{max_int64, max_int64, std::numeric_limits<std::uint64_t>::max()}}};
  for (const Histogram& histogram : histograms) {
    for (const auto axis : {Scale::Kind::linear, Scale::Kind::logarithmic}) {
      const XmlElement svg = parse_strictly(drawn(
          histogram,
          {"latency",
           axis,
           {{"max", histogram.back().last_ns, "mark-max"}, {"p99", 3, "mark-p99"}, {"p50", 2, "mark-p50"}}}));
      ASSERT_FALSE(svg.all("rect").empty());
      for (const XmlElement* bar : svg.all("rect")) {
        EXPECT_GT(number(*bar, "height"), 0.0);
        EXPECT_GT(number(*bar, "width"), 0.0);
        EXPECT_GE(number(*bar, "y"), 0.0);
        EXPECT_LE(number(*bar, "x") + number(*bar, "width"), 500.0);
      }
      expect_text_inside(svg);
    }
  }
}

TEST(HistogramChart, BarsGrowWithTheLogarithmOfTheCount) {
  const XmlElement svg =
      parse_strictly(drawn({{1'000, 1'999, 1}, {2'000, 3'999, 100}, {4'000, 7'999, 10'000}},
                           {"latency", Scale::Kind::logarithmic, {}}));
  const auto bars = svg.all("rect");
  ASSERT_EQ(bars.size(), 3U);
  const double step = number(*bars.at(1), "height") - number(*bars.at(0), "height");
  EXPECT_GT(step, 5.0);
  EXPECT_NEAR(number(*bars.at(2), "height") - number(*bars.at(1), "height"), step, 0.1)
      << "the count axis is logarithmic";
}

TEST(HistogramChart, NamesOfMarksAreNotCrossedByTallerMarks) {
  for (const std::int64_t p99 : {1'001, 1'100, 2'000, 10'000}) {
    for (const std::int64_t maximum : {10'001, 11'000, 100'000}) {
      const XmlElement svg = parse_strictly(
          drawn({{500, 600, 5}, {90'000, 100'000, 5}},
                {"latency",
                 Scale::Kind::logarithmic,
                 {{"max", maximum, "mark-max"}, {"p99", p99, "mark-p99"}, {"p50", 1'000, "mark-p50"}}}));
      for (const XmlElement* text : svg.all("text")) {
        const auto css = text->attributes.find("class");
        if (css == text->attributes.end() || css->second.find("mark-") == std::string::npos) continue;
        const bool start = text->attributes.at("text-anchor") == "start";
        const double length = text_width(text->text, 11.0);
        const double left = number(*text, "x") - (start ? 0.0 : length);
        for (const XmlElement* line : svg.all("line")) {
          if (line->attributes.at("class").find("mark ") == std::string::npos) continue;
          const bool taller = number(*line, "y1") < number(*text, "y") - 10.0;
          const double at = number(*line, "x1");
          EXPECT_FALSE(taller && at > left && at < left + length) << text->text;
        }
      }
    }
  }
}

TEST(HistogramOf, CountsEverySampleOnce) {
  std::mt19937_64 random(5);
  std::uniform_int_distribution<std::int64_t> any(std::numeric_limits<std::int64_t>::min(), max_int64);
  std::vector<std::int64_t> samples{0, 1, max_int64, std::numeric_limits<std::int64_t>::min()};
  for (int round = 0; round < 500; ++round)
    samples.push_back(any(random));
  const Histogram histogram = histogram_of(samples, 40);
  std::uint64_t total = 0;
  for (std::size_t index = 0; index < histogram.size(); ++index) {
    total += histogram[index].count;
    EXPECT_LE(histogram[index].first_ns, histogram[index].last_ns);
    EXPECT_TRUE(index == 0 || histogram[index].first_ns > histogram[index - 1].last_ns);
  }
  EXPECT_EQ(total, samples.size());
  EXPECT_LE(histogram.size(), 42U);
  EXPECT_TRUE(histogram_of({}, 40).empty());
}

TEST(QuantilesOf, AreRankedSamples) {
  EXPECT_EQ(quantiles_of({}).samples, 0U);
  std::vector<std::int64_t> samples;
  for (std::int64_t value = 1000; value >= 1; --value)
    samples.push_back(value);
  const Quantiles quantiles = quantiles_of(samples);
  EXPECT_EQ(quantiles.p50, 500);
  EXPECT_EQ(quantiles.p99, 990);
  EXPECT_EQ(quantiles.p999, 999);
  EXPECT_EQ(quantiles.max, 1000);
  EXPECT_EQ(quantiles_of({7}).p50, 7);
}

TEST(LabelPlacement, NeverOverlapsOrLeavesTheArea) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> x(0.0, 300.0);
  const PixelBox area{0.0, 0.0, 300.0, 200.0};
  LabelPlacement placement(area);
  std::vector<PixelBox> placed;
  int without_place = 0;
  for (int round = 0; round < 200; ++round) {
    const double left = x(random);
    const double top = x(random) * 2.0 / 3.0;
    const auto at = placement.place("label", {left, top, left + 5.0, top + 5.0});
    if (!at) {
      ++without_place;
      continue;
    }
    const PixelBox box{at->x, at->y - 10.0, at->x + text_width("label", 11.0), at->y + 4.0};
    EXPECT_TRUE(area.contains(box));
    for (const PixelBox& other : placed)
      EXPECT_FALSE(other.overlaps(box));
    placed.push_back(box);
  }
  EXPECT_GT(placed.size(), 30U);
  EXPECT_GT(without_place, 0) << "the area is small enough to fill up";
}

TEST(Clipped, PolygonIsTheAreaInside) {
  const ViewBox box{{0.0, 0.0}, {10.0, 10.0}};
  const std::vector<PointM> around{{-5, -5}, {15, -5}, {15, 15}, {-5, 15}};
  const auto corners = clipped(around, box);
  double twice_area = 0.0;
  for (std::size_t index = 0; index < corners.size(); ++index) {
    const PointM& a = corners[index];
    const PointM& b = corners[(index + 1) % corners.size()];
    twice_area += a.x_m * b.y_m - b.x_m * a.y_m;
    EXPECT_TRUE(a.x_m >= 0.0 && a.x_m <= 10.0 && a.y_m >= 0.0 && a.y_m <= 10.0);
  }
  EXPECT_NEAR(twice_area / 2.0, 100.0, 1e-9);
  EXPECT_TRUE(clipped(std::vector<PointM>{{20, 20}, {30, 20}, {30, 30}}, box).empty());
  EXPECT_TRUE(clipped(std::vector<PointM>{{1, 1}, {not_known, 2}, {3, 3}}, box).empty());
  EXPECT_TRUE(clipped({}, box).empty());
}

TEST(WorldToPixels, IsToScaleWithNorthUp) {
  const WorldToPixels place({{-10.0, -5.0}, {10.0, 5.0}}, 100.0, 50.0, 400.0);
  EXPECT_DOUBLE_EQ(place({-10.0, 5.0}).x, 100.0);
  EXPECT_DOUBLE_EQ(place({-10.0, 5.0}).y, 50.0);
  EXPECT_DOUBLE_EQ(place({0.0, 0.0}).x, 300.0);
  EXPECT_LT(place({0.0, 1.0}).y, place({0.0, 0.0}).y);
  EXPECT_DOUBLE_EQ(place({1.0, 0.0}).x - place({0.0, 0.0}).x, place({0.0, 0.0}).y - place({0.0, 1.0}).y);
}

std::string drawn(const TopView& view, PictureUse use) {
  Markup out;
  draw_top_view(out, view, use);
  return out.take();
}

TEST(TopView, ScaleBarIsToScale) {
  const XmlElement svg = parse_strictly(drawn(*test::full_record().top_view, PictureUse::inline_in_page));
  expect_text_inside(svg);
  // The tick marks of the x axis and the scale bar have the same scale.
  std::vector<std::pair<double, double>> ticks;
  double bar_m = 0.0;
  double bar_px = 0.0;
  for (const XmlElement* text : svg.all("text")) {
    if (text->text.ends_with(" m")) bar_m = std::stod(text->text);
    if (text->attributes.at("class").empty() && text->attributes.at("text-anchor") == "middle") {
      const bool negative = text->text.starts_with("\u2212");
      const double value = std::stod(negative ? text->text.substr(3) : text->text);
      ticks.emplace_back(number(*text, "x"), negative ? -value : value);
    }
  }
  for (const XmlElement* line : svg.all("line")) {
    if (line->attributes.at("class") == "rule" && number(*line, "y1") > 400.0) {
      bar_px = std::max(bar_px, number(*line, "x2") - number(*line, "x1"));
    }
  }
  ASSERT_GE(ticks.size(), 2U);
  const double pixels_per_metre =
      (ticks.back().first - ticks.front().first) / (ticks.back().second - ticks.front().second);
  EXPECT_NEAR(bar_px / bar_m, pixels_per_metre, 0.02);
}

TEST(TopView, ShowsNamesTracksFieldOfViewAndHits) {
  for (const PictureWidth width : {PictureWidth::page, PictureWidth::phone}) {
    Markup out;
    draw_top_view(out, *test::full_record().top_view, PictureUse::inline_in_page, width);
    const std::string text = out.take();
    for (const char* expected : {">ego<", ">car_1<", ">car_2<", "class=\"fan\"", "class=\"hits\"",
                                 "class=\"track track-ego\"", "y north"})
      EXPECT_NE(text.find(expected), std::string::npos) << expected;
    expect_text_inside(parse_strictly(text));
  }
}

TEST(TopView, DrawsEmptyAndInvalidContent) {
  EXPECT_NO_THROW(parse_strictly(drawn(TopView{}, PictureUse::inline_in_page)));
  TopView odd;
  odd.shapes = {{Layer::vehicle, "nowhere", {{not_known, 0}, {1, 1}, {2, HUGE_VAL}}},
                {Layer::ego, "", {}},
                {Layer::pole, "dot", {{1, 1}}}};
  odd.tracks = {
      {"empty", false, {}}, {"one", true, {{0, 1, 1}}}, {"far", false, {{0, 1e300, -1e300}, {1, 0, 0}}}};
  odd.fan = FieldOfView{{0, 0}, 0, not_known, 10};
  odd.scan_points = {{not_known, 0, 0, 0, 0, 0, 0}, {1e300, 1e300, 0, 0, 0, 0, 4'000'000'000U}};
  odd.view = ViewBox{{5, 5}, {-5, -5}};
  const std::string text = drawn(odd, PictureUse::standalone_file);
  EXPECT_NO_THROW(parse_strictly(text));
  EXPECT_EQ(text.find("nan"), std::string::npos);
  EXPECT_EQ(text.find("\"inf"), std::string::npos);
}

std::vector<PointM> square(double x_m, double y_m, double half_m) {
  return {{x_m - half_m, y_m - half_m},
          {x_m + half_m, y_m - half_m},
          {x_m + half_m, y_m + half_m},
          {x_m - half_m, y_m + half_m}};
}

void expect_box(const ViewBox& box, double x0, double y0, double x1, double y1) {
  EXPECT_NEAR(box.minimum.x_m, x0, 1e-9);
  EXPECT_NEAR(box.minimum.y_m, y0, 1e-9);
  EXPECT_NEAR(box.maximum.x_m, x1, 1e-9);
  EXPECT_NEAR(box.maximum.y_m, y1, 1e-9);
}

/// Permits every aspect ratio.
constexpr AspectLimits any_aspect{0.0, 1e9};

TEST(TopView, WindowIsTheBoundingBoxOfTheBodiesWithAMargin) {
  TopView view;
  view.shapes = {{Layer::ground, "ground", square(0, 0, 500)},
                 {Layer::road, "road", square(0, 0, 300)},
                 {Layer::structure, "terrain", square(10, 10, 400)},
                 {Layer::structure, "house", square(-40, 0, 10)},
                 {Layer::vehicle, "car", square(100, 20, 2)}};
  view.tracks = {{"car", false, {{0, 60.0, -30.0}, {1, 100.0, 20.0}}}};
  view.scan_points = {{900.0, 900.0, 0, 0, 0, 0, 0}};
  // The larger extent is 152 m, and 6 % of it 9.12 m.
  expect_box(window_of(view, any_aspect), -50 - 9.12, -30 - 9.12, 102 + 9.12, 22 + 9.12);

  TopView one_body;
  one_body.shapes = {{Layer::ground, "ground", square(0, 0, 500)},
                     {Layer::structure, "crate", square(100, 50, 1)}};
  expect_box(window_of(one_body, any_aspect), 95, 45, 105, 55);  // the margin is at least 4 m

  TopView no_body;
  no_body.shapes = {{Layer::ground, "ground", square(0, 0, 50)}};
  no_body.scan_points = {{100.0, 0.0, 0, 0, 0, 0, 0}};
  expect_box(window_of(no_body, any_aspect), -59, -59, 109, 59);  // everything counts

  TopView row;
  row.shapes = {{Layer::vehicle, "a", square(0, 0, 1)}, {Layer::vehicle, "b", square(100, 0, 1)}};
  const ViewBox box = window_of(row, {0.5, 1.0});  // extended to the aspect ratio
  EXPECT_NEAR((box.maximum.y_m - box.minimum.y_m) / (box.maximum.x_m - box.minimum.x_m), 0.5, 1e-9);
  EXPECT_NEAR(box.minimum.y_m, -box.maximum.y_m, 1e-9);
}

TEST(TopView, HasContentIfSomethingIsFinite) {
  TopView view;
  EXPECT_FALSE(has_content(view));
  view.shapes = {{Layer::ego, "", {}}, {Layer::pole, "", {{not_known, 0}}}};
  EXPECT_FALSE(has_content(view));
  view.scan_points = {{1, 1, 0, 0, 0, 0, 0}};
  EXPECT_TRUE(has_content(view));
}

TEST(TopView, NamesWithoutSpaceAreReturned) {
  TopView crowded;
  for (int index = 0; index < 60; ++index) {
    crowded.shapes.push_back(
        {Layer::vehicle, "vehicle number " + std::to_string(index), {{0, 0}, {4, 0}, {4, 2}, {0, 2}}});
  }
  Markup out;
  const TopViewResult result = draw_top_view(out, crowded, PictureUse::inline_in_page);
  const XmlElement svg = parse_strictly(out.take());
  const std::size_t shown = svg.whole_text().empty() ? 0 : [&] {
    std::size_t count = 0;
    for (const XmlElement* text : svg.all("text"))
      count += text->text.starts_with("vehicle number") ? 1 : 0;
    return count;
  }();
  EXPECT_GT(result.labels_without_space.size(), 0U);
  EXPECT_EQ(shown + result.labels_without_space.size(), 60U);
}

/// The pixels of a series' dots, by its colour.
std::vector<std::pair<double, double>> dots_of(const XmlElement& svg, const std::string& colour) {
  std::vector<std::pair<double, double>> dots;
  for (const XmlElement* path : svg.all("path")) {
    if (path->attributes.at("class") != "dots " + colour) continue;
    std::istringstream text(path->attributes.at("d"));
    char letter = 0;
    double x = 0.0, y = 0.0;
    while (text >> letter >> x >> y) {
      dots.emplace_back(x, y);
      text.ignore(2);  // h0
    }
  }
  return dots;
}

TEST(Plot, PointsAreToScaleOnLinearAndLogarithmicAxes) {
  const contribution::Plot plot{
      .title = "Rate",
      .x = {.quantity = "distance", .unit = "m"},
      .y = {.quantity = "time", .unit = "s", .logarithmic = true},
      .series = {{.name = "a", .points = {{0.0, 1.0}, {50.0, 10.0}, {100.0, 100.0}}},
                 {.name = "b", .points = {{25.0, 1.0}, {75.0, not_known}, {80.0, -1.0}, {100.0, 1.0}}}}};
  Markup out;
  draw_plot(out, plot, PictureUse::inline_in_page);
  const XmlElement svg = parse_strictly(out.take());
  expect_text_inside(svg);
  const auto a = dots_of(svg, "c0"), b = dots_of(svg, "c1");
  ASSERT_EQ(a.size(), 3U);
  ASSERT_EQ(b.size(), 2U) << "what is not known, and what has no logarithm, is left out";
  EXPECT_NEAR(a[1].first - a[0].first, a[2].first - a[1].first, 0.5);
  EXPECT_NEAR(a[0].second - a[1].second, a[1].second - a[2].second, 0.5) << "decades are equal";
  EXPECT_GT(a[0].second, a[2].second) << "larger values are higher";
  EXPECT_NEAR(b[0].first - a[0].first, 0.25 * (a[2].first - a[0].first), 0.5);
  EXPECT_EQ(b[0].second, a[0].second);
  std::size_t lines = 0;
  for (const XmlElement* path : svg.all("path"))
    lines += path->attributes.at("class") == "series c1" ? 1 : 0;
  EXPECT_EQ(lines, 0U) << "the gap interrupts the line";
}

TEST(Plot, BarsStandSideBySideFromZero) {
  const contribution::Plot plot{
      .title = "Counts",
      .x = {.quantity = "class"},
      .y = {.quantity = "count"},
      .series = {{.name = "a", .points = {{1.0, 4.0}, {2.0, -2.0}, {4.0, not_known}}},
                 {.name = "b", .points = {{1.0, 8.0}, {2.0, 0.0}}}},
      .bars = true};
  Markup out;
  draw_plot(out, plot, PictureUse::inline_in_page);
  const XmlElement svg = parse_strictly(out.take());
  expect_text_inside(svg);
  struct Bar {
    double x = 0.0, from = 0.0, to = 0.0;
  };
  std::map<std::string, std::vector<Bar>> bars;
  double width = 0.0;
  for (const XmlElement* path : svg.all("path")) {
    const std::string& name = path->attributes.at("class");
    if (!name.starts_with("series ")) continue;
    width = std::stod(path->attributes.at("style").substr(std::string("stroke-width:").size()));
    std::string d = path->attributes.at("d");
    std::ranges::replace_if(
        d, [](char c) { return c == 'M' || c == 'L' || c == ','; }, ' ');
    std::istringstream text(d);
    for (double x = 0.0, from = 0.0, again = 0.0, to = 0.0; text >> x >> from >> again >> to;) {
      EXPECT_EQ(x, again) << "vertical";
      bars[name].push_back({x, from, to});
    }
  }
  const auto &a = bars["series c0"], &b = bars["series c1"];
  ASSERT_EQ(a.size(), 2U) << "what is not known has no bar";
  ASSERT_EQ(b.size(), 2U);
  EXPECT_EQ(a[0].from, b[0].from);
  EXPECT_NEAR(b[0].x - a[0].x, width, 0.2) << "side by side";
  EXPECT_GT(a[1].x - a[0].x, 2.0 * width);
  EXPECT_NEAR(b[0].from - b[0].to, 2.0 * (a[0].from - a[0].to), 0.3) << "to scale";
  EXPECT_NEAR(a[1].to - a[1].from, 0.5 * (a[0].from - a[0].to), 0.3) << "downward";
}

TEST(Plot, WithoutPointsOrWithHugeOnesIsWellFormed) {
  for (const std::vector<std::array<double, 2>>& points : {std::vector<std::array<double, 2>>{},
                                                           {{1e308, -1e308}},
                                                           {{-1e308, 1e308}, {1e99, 1e-99}, {1.0, 1.0}},
                                                           {{5.0, 5.0}},
                                                           {{-3.0, 0.0}, {-2.0, 0.0}}}) {
    for (const bool logarithmic : {false, true}) {
      contribution::Plot plot{.title = "T", .series = {{.name = "a", .points = points}}};
      plot.x.logarithmic = plot.y.logarithmic = logarithmic;
      for (const PictureUse use : {PictureUse::inline_in_page, PictureUse::standalone_file}) {
        Markup out;
        draw_plot(out, plot, use);
        const std::string text = out.take();
        EXPECT_NO_THROW(parse_strictly(text));
        EXPECT_EQ(text.find("nan"), std::string::npos);
      }
    }
  }
}

TEST(PointPicture, ShowsItsDimensionsToScale) {
  const auto pictures = test::full_record().sections.at(0).pictures;
  const PictureFrame frame = common_frame(pictures);
  for (const Picture& picture : pictures) {
    Markup out;
    draw_point_picture(out, picture, frame, PictureUse::inline_in_page);
    const XmlElement svg = parse_strictly(out.take());
    expect_text_inside(svg);
    // The dimension lines have the ratios of their lengths.
    std::vector<double> lengths;
    for (const XmlElement* line : svg.all("line")) {
      const double length = number(*line, "x2") - number(*line, "x1");
      if (length > 0.0) lengths.push_back(length);
    }
    ASSERT_GE(lengths.size(), 3U);
    for (const std::size_t i : {0U, 1U}) {
      EXPECT_NEAR(lengths[i] / lengths[2], picture.dimensions[i].length_m / picture.dimensions[2].length_m,
                  0.002);
    }
  }
}

TEST(PointPicture, DrawsNoPointsAndAnyNumberOfDimensions) {
  for (std::size_t count = 0; count < 6; ++count) {
    const std::vector<Picture> pictures{
        {.title = "t", .dimensions = std::vector<contribution::Dimension>(count, {"length", not_known})}};
    Markup out;
    draw_point_picture(out, pictures.front(), common_frame(pictures), PictureUse::standalone_file);
    const std::string text = out.take();
    expect_text_inside(parse_strictly(text));
    EXPECT_NE(text.find("no point of the body was seen"), std::string::npos);
    EXPECT_EQ(text.find("not known") != std::string::npos, count > 0);
    EXPECT_EQ(text.find("nan"), std::string::npos);
  }
}

}  // namespace
}  // namespace hil::report
