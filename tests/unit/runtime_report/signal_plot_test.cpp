// Plots of signals: panels, lines, and pictures of any record.

#include "runtime/report/html/signal_plot.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>
#include <string>

#include "runtime/report/html/page_style.hpp"
#include "runtime/report/html/signal_lanes.hpp"
#include "runtime/report/html/signal_panels.hpp"
#include "runtime/report/html/signal_path.hpp"
#include "runtime/report/quantities.hpp"
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

TEST(DotsPath, MarksPartsThatAreTooShortToBeSeen) {
  const auto line = series("x", "m",
                           {{0, unknown, unknown},
                            {100, 5.0, 5.0},
                            {101, unknown, unknown},
                            {200, 2.0, 3.0},
                            {260, unknown, unknown},
                            {999, 10.0, 10.0}});
  EXPECT_EQ(dots_path(line, from_0_to_10, 5.0), "M100 5000h0M999 0h0");
  EXPECT_EQ(dots_path(line, from_0_to_10, 0.5), "") << "zoomed in, the lines can be seen";
  EXPECT_EQ(dots_path(series("x", "m", {}), from_0_to_10, 5.0), "");
}

TEST(TolerancePath, IsTheAreaAroundTheReference) {
  SignalSeries reference = series("x", "m", {{0, 5.0, 5.0}, {3, 5.0, 5.0}, {4, unknown, unknown}});
  reference.tolerance = 1.0;
  EXPECT_EQ(tolerance_path(reference, from_0_to_10),
            "M0 4000L2 4000L3 4000L3 4000L3 6000L3 6000L2 6000L0 6000Z");
  reference.tolerance = unknown;
  EXPECT_EQ(tolerance_path(reference, from_0_to_10), "");
}

std::vector<Panel> panels(const SignalPlots& all, std::vector<SignalLimit> limits = {},
                          std::vector<SignalInstant> instants = {}) {
  SignalPlot plot{.title = "t",
                  .expectations = {},
                  .series = {},
                  .limits = std::move(limits),
                  .instants = std::move(instants)};
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

std::vector<std::string> labels_of(const Panel& panel) {
  std::vector<std::string> labels;
  for (const PanelTick& tick : panel.ticks)
    labels.push_back(to_ascii(tick.label));
  return labels;
}

TEST(SignalPanels, HaveLabelsThatDifferWhereValuesAreClose) {
  SignalPlots all;
  all.series = {series("a", "m", {{0, 5.0, 5.0 + 1e-9}})};
  Panel panel = panels(all)[0];
  EXPECT_EQ(labels_of(panel), (std::vector<std::string>{"-5e-10", "0", "+5e-10"}));
  EXPECT_EQ(panel.notes, (std::vector<std::string>{"labels are distances from 5.0000000005 m"}));
  all.series = {series("a", "", {{0, 123456.5, 123456.50004}})};
  panel = panels(all)[0];
  EXPECT_EQ(panel.notes, (std::vector<std::string>{"labels are distances from 123456.50002"}))
      << "too long beside it";
  for (const auto& [low, high] : {std::pair(0.0, 10.0), std::pair(-3e-9, 7e-9), std::pair(1e6, 2e6)}) {
    all.series = {series("a", "m", {{0, low, high}})};
    EXPECT_TRUE(panels(all)[0].notes.empty()) << high;
  }
}

TEST(SignalPanels, HaveLabelsThatDifferForAnyRange) {
  std::mt19937_64 random(11);
  for (int round = 0; round < 5000; ++round) {
    const auto power = [&] { return std::pow(10.0, static_cast<double>(random() % 40) - 20.0); };
    const double low = (static_cast<double>(random() % 2001) - 1000.0) * power();
    const double high = low + static_cast<double>(random() % 1000) * power();
    SignalPlots all;
    all.series = {series("a", "m", {{0, low, high}})};
    const Panel panel = panels(all)[0];
    const std::vector<std::string> labels = labels_of(panel);
    ASSERT_FALSE(labels.empty()) << low << " " << high;
    for (std::size_t i = 1; i < labels.size(); ++i)
      ASSERT_NE(labels[i], labels[i - 1]) << low << " " << high;
  }
}

TEST(SignalPanels, SayThatValuesAreBeyondTheDrawnOnes) {
  SignalPlots all;
  all.series = {series("a", "m", {{0, 1.0, 2.0}, {1, 1.0, 1e101}, {2, 1.0, 2.0}})};
  Panel panel = panels(all)[0];
  EXPECT_EQ(panel.notes, (std::vector<std::string>{"values beyond 1e100 are cut"}));
  EXPECT_LT(panel.range.high, 3.0);
  all.series = {series("a", "m", {{0, -1e300, -1e300}})};
  panel = panels(all)[0];
  EXPECT_EQ(panel.notes.size(), 1U);
  EXPECT_TRUE(panel.is_known) << "its values are known, but can not be drawn";
  all.series = {series("a", "m", {{0, 1e100, 1e100}, {1, unknown, unknown}})};
  EXPECT_TRUE(panels(all)[0].notes.empty());
}

TEST(SignalPanels, ShowWhatATestTableExpects) {
  SignalPlots all;
  all.series = {series("a", "m", {{0, 1.0, 2.0}}), series("b", "km/h", {{0, 1.0, 2.0}})};
  const std::vector<Panel> found =
      panels(all, {}, {{0, 20, 5.0, 0.5}, {0, 30, 1.5, 1e6}, {7, 30, 1.0, 0.0}, {1, 10, unknown, 0.0}});
  ASSERT_EQ(found[0].instants.size(), 2U);
  EXPECT_EQ(found[0].instants[0].time_ns, 20);
  EXPECT_GT(found[0].range.high, 5.5) << "a value that the signal does not have";
  EXPECT_LT(found[0].range.high, 100.0) << "a tolerance that is far greater than the values";
  EXPECT_TRUE(found[1].instants.empty());
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
    const test::XmlElement drawn = parse_strictly(out.take());
    for (const test::XmlElement* group : drawn.all("g"))
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

/// The text of its lanes, and how many bars they have.
std::pair<std::vector<std::string>, std::size_t> lanes_in(const RunRecord& record) {
  const Lanes lanes = lanes_of(record, record.signal_plots.plots[0]);
  std::pair<std::vector<std::string>, std::size_t> found;
  for (const Lane& lane : lanes.shown) {
    found.first.push_back(lane.kind + " " + lane.name + lane.name_suffix);
    found.second += lane.spans.size();
  }
  return found;
}

TEST(SignalLanes, AreSharedByTheRowsOfATestTable) {
  RunRecord record = test::full_record();
  record.faults.clear();
  record.stimuli.clear();
  for (int i = 0; i < 30; ++i)
    record.faults.push_back({.name = "surge.line_" + std::to_string(i),
                             .target = "tank.level",
                             .effect = "stuck",
                             .begins = 1,
                             .spans = {{i * 100, i * 100 + 50}},
                             .test_table = "surge"});
  record.faults.push_back({.name = "own", .target = "a", .effect = "", .begins = 1, .spans = {{0, 10}}});
  record.stimuli = {{.name = "surge.tank.inflow",
                     .target = "tank.inflow",
                     .effect = "",
                     .begins = 1,
                     .spans = {{0, 4000}},
                     .test_table = "surge"},
                    {.name = "other.x",
                     .target = "x",
                     .effect = "",
                     .begins = 1,
                     .spans = {{0, 4000}},
                     .test_table = "other"}};
  const auto [names, spans] = lanes_in(record);
  EXPECT_EQ(names, (std::vector<std::string>{"test table surge", "fault own", "test table other"}));
  EXPECT_EQ(spans, 33U);
  const Lane surge = lanes_of(record, record.signal_plots.plots[0]).shown[0];
  EXPECT_FALSE(surge.spans[0].is_fault) << "faults are drawn over stimuli";
  EXPECT_EQ(surge.injections, 31U);
}

TEST(SignalLanes, CountWhatHasNoPlace) {
  RunRecord record = test::full_record();
  record.faults.clear();
  record.stimuli.clear();
  for (std::size_t i = 0; i < max_lanes + 3; ++i)
    record.stimuli.push_back(
        {.name = "s" + std::to_string(i), .target = "x", .effect = "", .begins = 1, .spans = {{0, 10}}});
  const Lanes lanes = lanes_of(record, record.signal_plots.plots[0]);
  EXPECT_EQ(lanes.shown.size(), max_lanes);
  EXPECT_EQ(lanes.left_out, 3U);
}

TEST(SignalPlotDrawing, DrawsExpectedValuesWithTheirTolerance) {
  RunRecord record = test::full_record();
  SignalPlot& plot = record.signal_plots.plots[0];
  plot.instants = {{plot.series[0], plot.begin_ns, 5.0, 1.0},
                   {plot.series[0], plot.end_ns, 5.0, 0.0},
                   {plot.series[0], plot.end_ns + 1, 5.0, 1.0}};
  Markup out;
  draw_signal_plot(out, record, plot, PictureUse::inline_in_page);
  std::ptrdiff_t values = 0, tolerances = 0;
  const test::XmlElement svg = parse_strictly(out.take());
  for (const test::XmlElement* path : svg.all("path")) {
    const auto css_class = path->attributes.find("class");
    if (css_class == path->attributes.end()) continue;
    const std::ptrdiff_t marks = std::ranges::count(path->attributes.at("d"), 'M');
    if (css_class->second == "expected") values += marks;
    if (css_class->second == "tolerance") tolerances += marks;
  }
  EXPECT_EQ(values, 2) << "the third one is outside of the plot";
  EXPECT_EQ(tolerances, 1);
}

TEST(SignalPlotDrawing, LeavesOutWhatTheRecordDoesNotHave) {
  RunRecord record = test::full_record();
  SignalPlot& plot = record.signal_plots.plots[0];
  plot.series = {99};
  plot.expectations = {99};
  plot.limits = {{99, 1.0}};
  plot.instants = {{99, plot.begin_ns, 1.0, 0.0}};
  plot.end_ns = plot.begin_ns;
  Markup out;
  draw_signal_plot(out, record, plot, PictureUse::inline_in_page);
  EXPECT_TRUE(parse_strictly(out.take()).all("path").size() < 50U);
}

}  // namespace
}  // namespace hil::report
