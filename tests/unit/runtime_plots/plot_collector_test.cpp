// The plots of a scenario, tick by tick.

#include "runtime/plots/plot_collector.hpp"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/support/allocation_guard.hpp"
#include "tests/unit/runtime_run/wiring_fixture.hpp"

namespace hil::plots {
namespace {

constexpr std::int64_t ms = 1'000'000;

class Plots : public run::test::WiringFixture {
 protected:
  Plots() { folder_.write("curve.csv", "time,x\n0.002,1\n0.004,3\n"); }

  /// The block `plant` has the signals x in m, u in km/h, and on, a plain number.
  void open(const std::string& sections) {
    wiring_ = wired(
        "scenario: s\nbase_rate: 1 kHz\nduration: 1 s\ntasks:\n"
        "  - module: plant\n    type: block\n    rate: 1 kHz\n"
        "    parameters: {states: {x: {unit: m}, u: {unit: km/h}, on: {unit: '1'}}}\n" +
        sections);
    ASSERT_TRUE(wiring_) << diagnostics_.to_text();
    plots_.emplace(*scenario_, wiring_->signals);
  }
  void write(const std::string& signal, double value) {
    wiring_->signals.write(*wiring_->signals.find(signal), value, time_ns_);
  }
  /// The end of a tick in which x has this value.
  void tick(double x) {
    write("plant.x", x);
    plots_->take(wiring_->signals, time_ns_);
    time_ns_ += ms;
  }
  report::SignalPlots filled(const std::vector<report::ExpectationResult>& results) {
    report::RunRecord record;
    for (const report::ExpectationResult result : results)
      record.expectations.push_back({.name = "", .result = result, .detail = ""});
    plots_->fill(wiring_->signals, time_ns_, record);
    return record.signal_plots;
  }
  static std::vector<std::string> names(const report::SignalPlots& plots, const report::SignalPlot& plot) {
    std::vector<std::string> names;
    for (const std::uint32_t index : plot.series)
      names.push_back(plots.series.at(index).name);
    return names;
  }

  std::optional<run::Wiring> wiring_;
  std::optional<PlotCollector> plots_;
  std::int64_t time_ns_ = 0;
};

constexpr auto held = report::ExpectationResult::held;
constexpr auto failed = report::ExpectationResult::failed;

TEST_F(Plots, ShowWhatExpectationsReadAndTheirLimitsInTheUnitOfTheSignal) {
  open(
      "expectations:\n  - {name: in bounds, always: plant.x < 250 cm and -1 m <= plant.x and plant.u > 3}\n");
  for (int i = 0; i < 4; ++i)
    tick(i);
  const report::SignalPlots plots = filled({held});
  ASSERT_EQ(plots.plots.size(), 1U);
  const report::SignalPlot& plot = plots.plots[0];
  EXPECT_EQ(plot.title, "in bounds");
  EXPECT_EQ(names(plots, plot), (std::vector<std::string>{"plant.x", "plant.u"}));
  ASSERT_EQ(plot.limits.size(), 3U);
  EXPECT_DOUBLE_EQ(plot.limits[0].value, 2.5);
  EXPECT_DOUBLE_EQ(plot.limits[1].value, -1.0);
  EXPECT_DOUBLE_EQ(plot.limits[2].value, 3.0);
  EXPECT_EQ(plots.series[plot.limits[2].series].name, "plant.u");
  EXPECT_EQ(plots.series[0].bucket_ns, ms);
  EXPECT_EQ(plots.series[0].points,
            (std::vector<report::SignalPoint>{{0, 0.0, 0.0}, {1, 1.0, 1.0}, {2, 2.0, 2.0}, {3, 3.0, 3.0}}));
  EXPECT_EQ(plot.end_ns, 4 * ms);
}

TEST_F(Plots, AreSharedByExpectationsOfTheSameSignalsAndFailedOnesComeFirst) {
  open(
      "expectations:\n  - {name: a, always: plant.x < 9 m}\n  - {name: b, never: plant.u > 5 km/h}\n"
      "  - {name: c, eventually: plant.x > 1 m}\n"
      "plots: [{title: P, signals: [plant.on]}]\n");
  tick(2.0);
  const report::SignalPlots plots = filled({held, failed, held});
  ASSERT_EQ(plots.plots.size(), 3U);
  EXPECT_EQ(plots.plots[0].title, "b");
  EXPECT_EQ(plots.plots[0].expectations, (std::vector<std::uint32_t>{1}));
  EXPECT_EQ(plots.plots[1].title, "P");
  EXPECT_EQ(plots.plots[2].expectations, (std::vector<std::uint32_t>{0, 2}));
  EXPECT_EQ(plots.series.size(), 3U);
}

TEST_F(Plots, HaveTheFaultedSignalBesideTheTrueOne) {
  open(
      "  - module: reader\n    type: block\n    rate: 1 kHz\n    inputs: {x: plant.x}\n"
      "    parameters: {inputs: {x: m}, outputs: {y: x}}\n"
      "faults: [{name: f, signal: plant.x, gain: 2, at: 1 ms}]\n"
      "expectations: [{name: a, always: plant.x < 9 m and plant.x.faulted < 9 m}]\n");
  tick(2.0);
  const report::SignalPlots plots = filled({held});
  ASSERT_EQ(plots.plots.size(), 1U);
  EXPECT_EQ(names(plots, plots.plots[0]), (std::vector<std::string>{"plant.x", "plant.x.faulted"}));
  EXPECT_EQ(plots.series[0].kind, report::SeriesKind::signal);
  EXPECT_EQ(plots.series[1].kind, report::SeriesKind::faulted);
}

TEST_F(Plots, OfAPartOfTheRunBeginAtATick) {
  open("plots: [{title: P, signals: [plant.x], from: 1500 us, until: 4 ms}]\n");
  for (int i = 0; i < 8; ++i)
    tick(i);
  const report::SignalPlots plots = filled({});
  EXPECT_EQ(plots.plots[0].begin_ns, 2 * ms);
  EXPECT_EQ(plots.plots[0].end_ns, 4 * ms);
  EXPECT_EQ(plots.series[0].begin_ns, 2 * ms);
  EXPECT_EQ(plots.series[0].points,
            (std::vector<report::SignalPoint>{{0, 2.0, 2.0}, {1, 3.0, 3.0}, {2, 4.0, 4.0}}));
}

TEST_F(Plots, OfAPartThatTheRunDidNotReachHaveNoLength) {
  open("plots: [{title: P, signals: [plant.x], from: 500 ms}]\n");
  tick(1.0);
  const report::SignalPlots plots = filled({});
  EXPECT_EQ(plots.plots[0].begin_ns, 500 * ms);
  EXPECT_EQ(plots.plots[0].end_ns, 500 * ms);
  EXPECT_TRUE(plots.series[0].points.empty());
}

TEST_F(Plots, HaveTheReferenceOfTracks) {
  open("expectations:\n  - {name: a, tracks: {signal: plant.x, reference: curve.csv, tolerance: 50 cm}}\n");
  for (int i = 0; i < 6; ++i)
    tick(i);
  const report::SignalPlots plots = filled({held});
  ASSERT_EQ(plots.series.size(), 2U);
  const report::SignalSeries& reference = plots.series[1];
  EXPECT_EQ(reference.kind, report::SeriesKind::reference);
  EXPECT_DOUBLE_EQ(reference.tolerance, 0.5);
  ASSERT_EQ(reference.points.size(), 5U);  // no value before 2 ms and after 4 ms
  EXPECT_EQ(reference.points[2], (report::SignalPoint{3, 2.0, 2.0}));
  EXPECT_EQ(plots.plots[0].series, (std::vector<std::uint32_t>{0, 1}));
}

TEST_F(Plots, HaveTheValuesThatATestTableExpects) {
  folder_.write("table.csv",
                "time,signal,expectation,tolerance\n0.0015,plant.x,250 cm,1 cm\n0.003,plant.u,3,1\n"
                "0.004,plant.x,4,0\n");
  open("test_tables: [{name: t, file: table.csv}]\nexpectations: [{name: a, always: plant.x < 9 m}]\n");
  for (int i = 0; i < 6; ++i)
    tick(i);
  const report::SignalPlots plots = filled({held, held, held});
  ASSERT_EQ(plots.plots.size(), 2U);
  EXPECT_EQ(plots.plots[0].expectations.size(), 2U) << "beside the limit of another expectation";
  ASSERT_EQ(plots.plots[0].instants.size(), 2U);
  const report::SignalInstant& instant = plots.plots[0].instants[0];
  EXPECT_EQ(plots.series[instant.series].name, "plant.x");
  EXPECT_EQ(instant.time_ns, 2 * ms) << "the tick in which it is judged";
  EXPECT_DOUBLE_EQ(instant.value, 2.5);
  EXPECT_DOUBLE_EQ(instant.tolerance, 0.01);
  EXPECT_EQ(plots.plots[1].instants.size(), 1U);
}

TEST_F(Plots, SayWhichExpectationsHaveNoPlace) {
  std::string text = "  - module: many\n    type: block\n    rate: 1 kHz\n    parameters:\n      states:\n";
  std::string expectations = "expectations:\n";
  for (int i = 0; i < 70; ++i) {
    const std::string s = "s" + std::to_string(i);
    text += "        " + s + ": {unit: m}\n";
    expectations += "  - {name: " + s + ", always: many." + s + " < 1 m}\n";
  }
  open(text + expectations);
  tick(0.0);
  const report::SignalPlots plots = filled(std::vector<report::ExpectationResult>(70, held));
  EXPECT_EQ(plots.series.size(), report::max_expectation_series);
  EXPECT_EQ(plots.not_plotted, (std::vector<std::string>{"s64", "s65", "s66", "s67", "s68", "s69"}));
}

TEST_F(Plots, AreTakenWithoutAllocation) {
  open("expectations: [{name: a, always: plant.x < 9 m}]\nplots: [{title: P, signals: [plant.u]}]\n");
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (std::int64_t i = 0; i < 20'000; ++i)
    plots_->take(wiring_->signals, i * ms);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

TEST_F(Plots, OfSignalsThatDoNotExistAreRefused) {
  EXPECT_FALSE(wired(
      "scenario: s\nduration: 1 s\ntasks:\n  - {module: plant, type: block, rate: 1 kHz, parameters: "
      "{states: {x: {unit: m}}}}\nplots: [{title: P, signals: [plant.y]}, {title: Q, signals: [plan.x]}]\n"));
  EXPECT_EQ(diagnostics_.count(), 2U) << diagnostics_.to_text();
  EXPECT_NE(diagnostics_.to_text().find("plant.y"), std::string::npos) << diagnostics_.to_text();
}

}  // namespace
}  // namespace hil::plots
