// Plots of signals: panels, lines, and pictures of any record.

#include "runtime/report/html/signal_plot.hpp"

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "runtime/report/html/page_style.hpp"
#include "runtime/report/html/signal_panels.hpp"
#include "runtime/report/html/signal_path.hpp"
#include "sample_record.hpp"
#include "strict_xml.hpp"

namespace hil::report {
namespace {

using test::parse_strictly;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

SignalSeries series(std::string name, std::string unit, std::vector<SignalPoint> points) {
  return {.name = std::move(name),
          .unit = std::move(unit),
          .named_values = {},
          .begin_ns = 0,
          .bucket_ns = 10,
          .points = std::move(points)};
}

const ViewportScale from_0_to_10{.begin_ns = 0, .column_ns = 10, .range = {0.0, 10.0}};

TEST(SignalPath, HoldsAValueUntilTheBucketBeforeTheNextOne) {
  const auto line = series("x", "m", {{0, 1.0, 1.0}, {4, 2.0, 2.0}, {5, 3.0, 3.0}, {9, 3.0, 3.0}});
  EXPECT_EQ(signal_path(line, from_0_to_10, false), "M0 9000h3l1 -1000l1 -1000h3l1 0h1");
}

TEST(SignalPath, HasStepsWhereThereAreNoValuesBetween) {
  const auto line = series("x", "", {{0, 0.0, 0.0}, {4, 10.0, 10.0}, {6, 10.0, 10.0}});
  EXPECT_EQ(signal_path(line, from_0_to_10, true), "M0 10000h4l0 -10000h2l0 0h1");
}

TEST(SignalPath, ShowsTheRangeOfABucketAndEndsNearTheNextOne) {
  const auto line = series("x", "m", {{0, 1.0, 1.0}, {1, 2.0, 9.0}, {2, 3.0, 8.0}, {3, 0.0, 0.0}});
  EXPECT_EQ(signal_path(line, from_0_to_10, false), "M0 9000l1 -1000v-7000l1 1000v5000l1 3000h1");
}

TEST(SignalPath, IsInterruptedWhereTheValueIsUnknown) {
  const auto line =
      series("x", "m", {{0, unknown, unknown}, {1, 5.0, 5.0}, {3, unknown, unknown}, {5, 6.0, 6.0}});
  EXPECT_EQ(signal_path(line, from_0_to_10, false), "M1 5000h2M5 4000h1");
  EXPECT_EQ(signal_path(series("x", "m", {{0, unknown, unknown}}), from_0_to_10, false), "");
  EXPECT_EQ(signal_path(series("x", "m", {}), from_0_to_10, false), "");
}

TEST(SignalPath, KeepsNumbersInRangeForAnyRecord) {
  SignalSeries wild =
      series("x", "m", {{0, -1e300, 1e300}, {std::numeric_limits<std::uint64_t>::max(), 1, 2}});
  wild.begin_ns = std::numeric_limits<std::int64_t>::min() / 2;
  wild.bucket_ns = std::numeric_limits<std::int64_t>::max();
  EXPECT_FALSE(signal_path(wild, from_0_to_10, false).empty());
}

TEST(TolerancePath, IsTheAreaAroundTheReference) {
  SignalSeries reference = series("x", "m", {{0, 5.0, 5.0}, {3, 5.0, 5.0}, {4, unknown, unknown}});
  reference.tolerance = 1.0;
  EXPECT_EQ(tolerance_path(reference, from_0_to_10),
            "M0 4000L2 4000L3 4000L3 4000L3 6000L3 6000L2 6000L0 6000Z");
  reference.tolerance = unknown;
  EXPECT_EQ(tolerance_path(reference, from_0_to_10), "");
}

std::vector<Panel> panels(const SignalPlots& all, std::vector<SignalLimit> limits = {}) {
  SignalPlot plot{.title = "t", .expectations = {}, .series = {}, .limits = std::move(limits)};
  for (std::uint32_t i = 0; i < all.series.size(); ++i)
    plot.series.push_back(i);
  return panels_of(all, plot);
}

TEST(SignalPanels, AreSharedByUnit) {
  SignalPlots all;
  all.series = {series("a", "m", {{0, 1.5, 1.5}}),      series("on", "", {{0, 0.0, 1.0}}),
                series("b", "m", {{0, 7.0, 7.0}}),      series("c", "km/h", {{0, 1.0, 1.0}}),
                series("ratio", "", {{0, 0.25, 0.25}}), series("a.faulted", "m", {{0, 3.0, 3.0}})};
  all.series.back().kind = SeriesKind::faulted;
  const std::vector<Panel> found = panels(all);
  ASSERT_EQ(found.size(), 4U);
  ASSERT_EQ(found[0].series.size(), 3U);
  EXPECT_EQ(found[0].series[2].series->name, "a.faulted");
  EXPECT_EQ(found[0].series[2].colour, found[0].series[0].colour);
  EXPECT_NE(found[0].series[1].colour, found[0].series[0].colour);
  EXPECT_LT(found[0].range.low, 1.5);
  EXPECT_GT(found[0].range.high, 7.0);
  EXPECT_TRUE(found[1].is_discrete);
  EXPECT_FALSE(found[3].is_discrete);
}

TEST(SignalPanels, HaveNamesOfValuesAsTicks) {
  SignalPlots all;
  all.series = {series("gear", "", {{0, 0.0, 0.0}, {3, 4.0, 4.0}})};
  all.series[0].named_values = {{0.0, "park"}, {4.0, "drive"}, {15.0, "invalid"}};
  const std::vector<Panel> found = panels(all);
  ASSERT_EQ(found[0].ticks.size(), 2U);
  EXPECT_EQ(found[0].ticks[1].label, "drive");
}

TEST(SignalPanels, ShowLimitsUnlessTheyAreFarAway) {
  SignalPlots all;
  all.series = {series("a", "m", {{0, 1.0, 3.0}})};
  const std::vector<Panel> found = panels(all, {{0, 5.0}, {0, 5.0}, {0, 1e6}, {7, 2.0}});
  EXPECT_EQ(found[0].limits, (std::vector<double>{5.0, 1e6}));
  EXPECT_GT(found[0].range.high, 5.0);
  EXPECT_LT(found[0].range.high, 10.0);
}

TEST(SignalPanels, OfUnknownValuesHaveARange) {
  SignalPlots all;
  all.series = {series("a", "m", {{0, unknown, unknown}}), series("b", "", {})};
  for (const Panel& panel : panels(all)) {
    EXPECT_FALSE(panel.is_known);
    EXPECT_LT(panel.range.low, panel.range.high);
  }
}

TEST(SignalPlotDrawing, IsAWholePictureOnItsOwn) {
  const RunRecord record = test::full_record();
  Markup out;
  draw_signal_plot(out, record, record.signal_plots.plots[0], PictureUse::standalone_file);
  const test::XmlElement svg = parse_strictly(out.take());
  const std::string text = svg.whole_text();
  for (const char* expected : {"no collision", "ego.speed [m/s]", "ego.speed.faulted [m/s]", "12.5 m/s",
                               "fault stuck", "stimulus profile", "events", "red", "green", "10 s"})
    EXPECT_NE(text.find(expected), std::string::npos) << expected;
  int failures = 0;
  for (const test::XmlElement* path : svg.all("path"))
    failures +=
        path->attributes.contains("class") && path->attributes.at("class") == "marker-failure" ? 1 : 0;
  EXPECT_EQ(failures, 2) << "one in each panel";
}

TEST(SignalPlotDrawing, GuttersAreThoseOfTheStyleOfThePage) {
  const std::string margin =
      "margin:8px " + pixels(signal_plot_right_gutter) + "px 0 " + pixels(signal_plot_left_gutter) + "px";
  const std::string width =
      "calc(100% - " + pixels(signal_plot_left_gutter + signal_plot_right_gutter) + "px)";
  EXPECT_NE(page_style().find(margin), std::string_view::npos) << margin;
  EXPECT_NE(page_style().find(width), std::string_view::npos) << width;
}

TEST(SignalPlotDrawing, OfARunThatEndedBeforeItHasNoTimes) {
  RunRecord record = test::full_record();
  SignalPlot& plot = record.signal_plots.plots[0];
  for (const std::int64_t end_ns : {plot.begin_ns, plot.begin_ns - 5}) {
    plot.end_ns = end_ns;
    Markup out;
    draw_signal_plot(out, record, plot, PictureUse::inline_in_page);
    for (const test::XmlElement* group : parse_strictly(out.take()).all("g"))
      EXPECT_TRUE(group->children.empty());
  }
}

TEST(SignalPlotDrawing, NamesTheNumberOfTimesOfABarThatIsCut) {
  RunRecord record = test::full_record();
  record.faults[0].begins = 7;
  Markup out;
  draw_signal_plot(out, record, record.signal_plots.plots[0], PictureUse::inline_in_page);
  EXPECT_NE(parse_strictly(out.take()).whole_text().find("fault stuck, the first 2"), std::string::npos);
}

TEST(SignalPlotDrawing, LeavesOutWhatTheRecordDoesNotHave) {
  RunRecord record = test::full_record();
  SignalPlot& plot = record.signal_plots.plots[0];
  plot.series = {99};
  plot.expectations = {99};
  plot.limits = {{99, 1.0}};
  plot.end_ns = plot.begin_ns;
  Markup out;
  draw_signal_plot(out, record, plot, PictureUse::inline_in_page);
  EXPECT_TRUE(parse_strictly(out.take()).all("path").size() < 50U);
}

}  // namespace
}  // namespace hil::report
