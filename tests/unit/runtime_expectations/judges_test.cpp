// Each frame is an instant of its own, before the tick that latches it.

#include "runtime/expectations/judges.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "runtime/expectations/statistics.hpp"
#include "runtime/expectations/tracks.hpp"
#include "runtime/signals/signal_expression.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/runtime_expectations/arriving_device.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

/// One variable over the signals of a run.
class OneVariable final : public ComputedSignals {
 public:
  OneVariable(signals::SignalTable& table, const std::string& text)
      : signal_(table.add({.name = "computed", .unit = "", .writer = "variables"})) {
    config::Diagnostics diagnostics;
    expression_ = signals::SignalExpression::compile(condition(text), table, {.unit = ""},
                                                     {.period_ns = ms, .seed = 1}, diagnostics);
    if (!expression_) throw std::runtime_error(diagnostics.to_text());
  }
  std::vector<std::uint32_t> numbers_reading(std::span<const signals::SignalId> signals) const override {
    const auto& read = expression_->signals();
    return std::ranges::find_first_of(read, signals) == read.end() ? std::vector<std::uint32_t>{}
                                                                   : std::vector<std::uint32_t>{0};
  }
  std::vector<signals::SignalId> with_sources(std::vector<signals::SignalId> signals) const override {
    if (std::ranges::find(signals, signal_) != signals.end())
      signals.insert(signals.end(), expression_->signals().begin(), expression_->signals().end());
    return signals;
  }
  void update_at_frame(signals::SignalTable& table, std::int64_t time_ns,
                       std::span<const std::uint32_t> numbers) noexcept override {
    if (!numbers.empty()) update(table, {.time_ns = time_ns, .is_tick = false});
  }
  void update(signals::SignalTable& table, signals::Instant instant) noexcept {
    table.write(signal_, expression_->evaluate(table, instant, signals::Unpublished::unknown),
                instant.time_ns);
  }

 private:
  const signals::SignalId signal_;
  std::optional<signals::SignalExpression> expression_;
};

/// A message with the signals Mode and Level, and a signal of a module, in ticks of 10 ms.
class FramesAsInstants : public Expectations {
 protected:
  FramesAsInstants() {
    scenario_.base_period_ns = 10 * ms;
    scenario_.duration_ticks = 1'000;
    arrivals_.keep(device_, links_, mode_);
    arrivals_.keep(device_, links_, level_);
  }

  template <class Data>
  void expect_that(const std::string& name, Data claim, std::optional<config::WindowSection> window = {}) {
    scenario_.expectations.push_back(
        {.name = name, .place = {}, .window = std::move(window), .claim = claim_of(std::move(claim))});
  }
  void frame(double mode, double level, std::int64_t time_ns) {
    device_.receive({{0, mode}, {1, level}}, time_ns);
    newest_ = {mode, level, static_cast<double>(time_ns)};
  }
  /// The next tick, which latches the newest frame. `speed` is published in it.
  void tick(double speed = 0.0) {
    if (!judges_) judges_.emplace(scenario_, table_, arrivals_, variable_);
    const std::int64_t time_ns = ticks_++ * scenario_.base_period_ns;
    if (!newest_.empty()) {
      table_.write(mode_, newest_[0], static_cast<std::int64_t>(newest_[2]));
      table_.write(level_, newest_[1], static_cast<std::int64_t>(newest_[2]));
      table_.write(fresh_, 1.0, time_ns);
    }
    table_.write(speed_, speed, time_ns);
    judges_->check_frames(time_ns);
    variable_.update(table_, {.time_ns = time_ns});
    judges_->check(table_, time_ns);
  }
  report::RunRecord record() {
    report::RunRecord record;
    judges_->fill({.end_ns = ticks_ * scenario_.base_period_ns,
                   .ticks = static_cast<std::uint64_t>(ticks_),
                   .period_ns = scenario_.base_period_ns},
                  record);
    return record;
  }
  report::Expectation result(const std::string& name) {
    const report::RunRecord all = record();
    for (const report::Expectation& expectation : all.expectations)
      if (expectation.name == name) return expectation;
    ADD_FAILURE() << name;
    return {};
  }
  /// The times of a reaction or a response.
  std::vector<std::int64_t> result_times(const std::string& name) {
    const report::RunRecord all = record();
    for (const report::ResponseTime& times : all.response_times)
      if (times.name == name) return times.samples_ns;
    ADD_FAILURE() << name;
    return {};
  }

  config::Scenario scenario_;
  const signals::SignalId mode_ =
      table_.add({.name = "can.car.Status.Mode", .unit = "", .writer = "can.car", .arrives = true});
  const signals::SignalId level_ =
      table_.add({.name = "can.car.Status.Level", .unit = "", .writer = "can.car", .arrives = true});
  const signals::SignalId fresh_ =
      table_.add({.name = "can.car.Status.fresh", .unit = "", .writer = "can.car"});
  OneVariable variable_{table_, "count(can.car.Status.Mode == 3) + previous(can.car.Status.Level, 0) * 0"};
  const signals::Links links_{.inputs = {mode_, level_}, .outputs = {}, .connected = {}, .fresh = {fresh_}};
  ArrivingDevice device_{2};
  std::optional<Judges> judges_;

 private:
  std::vector<double> newest_;
  std::int64_t ticks_ = 0;
};

TEST_F(FramesAsInstants, AreSeenByConditionsOfAllKinds) {
  expect_that("never", Never{condition("can.car.Status.Mode == 3")});
  expect_that("always", Always{condition("can.car.Status.Mode < 3")});
  expect_that("eventually", Eventually{condition("can.car.Status.Mode == 3"), {}});
  expect_that("count", Count{.condition = condition("can.car.Status.Mode == 3"), .min = 0, .max = 1});
  expect_that("order", Order{{condition("can.car.Status.Mode == 3"), condition("can.car.Status.Mode == 4")}});
  expect_that("reaction",
              Reaction{condition("can.car.Status.Mode == 3"), condition("can.car.Status.Mode == 4"), ms});
  frame(1, 0, -ms);
  tick();
  // Two flashes in one tick, each followed by a 4 after 2 ms.
  frame(3, 0, 2 * ms);
  frame(4, 0, 4 * ms);
  frame(1, 0, 5 * ms);
  frame(3, 0, 6 * ms);
  frame(4, 0, 8 * ms);
  frame(1, 0, 9 * ms);
  tick();
  tick();
  EXPECT_EQ(result("never").first_failure_ns, 2 * ms);
  EXPECT_EQ(result("always").first_failure_ns, 2 * ms);
  EXPECT_EQ(result("always").margin, -1.0) << "the margin is that of the instants too";
  EXPECT_EQ(result("eventually").met_ns, 2 * ms);
  EXPECT_EQ(result("count").first_failure_ns, 6 * ms);
  EXPECT_EQ(result("order").result, Result::held);
  EXPECT_DOUBLE_EQ(result("order").margin, 0.002);
  EXPECT_EQ(result("reaction").result, Result::failed);
  EXPECT_EQ(result("reaction").first_failure_ns, 3 * ms);
  for (const char* name : {"never", "always", "count", "order"}) {
    EXPECT_EQ(result(name).evaluated_ticks, 3U) << name << ": coverage is by tick";
    EXPECT_EQ(result(name).covered_ticks, 3U);
  }
}

TEST_F(FramesAsInstants, HaveAllTheirSignalsAtOnceAndOthersAsTheyWere) {
  expect_that("alike", Always{condition("can.car.Status.Mode == can.car.Status.Level")});
  expect_that("old", Never{condition("can.car.Status.Mode == 5 and ego.speed > 1")});
  expect_that("fresh", Never{condition("can.car.Status.Mode > 0 and can.car.Status.fresh == 0")});
  tick(0.0);
  frame(5, 5, 12 * ms);
  frame(7, 7, 14 * ms);
  tick(2.0);  // published after the frames
  frame(8, 8, 22 * ms);
  tick(2.0);
  EXPECT_EQ(result("alike").result, Result::not_checked) << "unknown in the first of four ticks";
  EXPECT_FALSE(result("alike").first_failure_ns);
  EXPECT_FALSE(result("old").first_failure_ns);
  EXPECT_FALSE(result("fresh").first_failure_ns);
}

TEST_F(FramesAsInstants, OpenAndCloseWindows) {
  const config::WindowSection window{.place = {},
                                     .from_ns = {},
                                     .to_ns = {},
                                     .after = condition("can.car.Status.Mode == 3"),
                                     .until = condition("can.car.Status.Mode == 4")};
  expect_that("in", Never{condition("can.car.Status.Level == 9")}, window);
  expect_that("out", Never{condition("can.car.Status.Level == 8")}, window);
  frame(1, 0, 0);
  tick();
  frame(1, 8, ms);  // before the window
  frame(3, 0, 2 * ms);
  frame(3, 9, 3 * ms);
  frame(4, 8, 4 * ms);  // after it
  frame(1, 8, 5 * ms);
  tick();
  EXPECT_EQ(result("in").first_failure_ns, 3 * ms);
  EXPECT_FALSE(result("out").first_failure_ns);
}

TEST_F(FramesAsInstants, AdvanceVariablesAndMemoryOnce) {
  expect_that("variable", Never{condition("computed > 2")});
  expect_that("function",
              Never{condition("count(can.car.Status.Mode == 3 and can.car.Status.Level == 0) > 2")});
  expect_that("duration", Never{condition("duration(can.car.Status.Mode == 3) > 3 ms")});
  frame(1, 0, 0);
  tick();
  for (int i = 0; i < 2; ++i) {
    frame(3, 0, (1 + 4 * i) * ms);
    frame(1, 0, (3 + 4 * i) * ms);
  }
  tick();
  for (const char* name : {"variable", "function", "duration"})
    EXPECT_EQ(result(name).result, Result::held) << result(name).detail;
  frame(3, 0, 11 * ms);
  frame(3, 0, 15 * ms);
  tick();
  EXPECT_EQ(result("variable").first_failure_ns, 11 * ms);
  EXPECT_EQ(result("function").first_failure_ns, 11 * ms);
  EXPECT_EQ(result("duration").first_failure_ns, 15 * ms);
}

TEST_F(FramesAsInstants, ThatAreLostLeaveWhatDidNotFailUnchecked) {
  expect_that("holds", Never{condition("can.car.Status.Mode == 3")});
  expect_that("fails", Never{condition("can.car.Status.Mode == 1")});
  expect_that("misses", Eventually{condition("can.car.Status.Mode == 3"), {}});
  expect_that("another signal", Never{condition("ego.speed > 5")});
  frame(1, 0, 0);
  device_.lose(2);
  tick();
  EXPECT_EQ(result("holds").result, Result::not_checked);
  EXPECT_NE(result("holds").detail.find("2 frames were lost"), std::string::npos) << result("holds").detail;
  EXPECT_EQ(result("fails").result, Result::failed);
  EXPECT_EQ(result("misses").result, Result::not_checked);
  EXPECT_EQ(result("another signal").result, Result::held);
}

/// More reactions are open than a run of this length has ticks.
TEST_F(FramesAsInstants, BeginAnyNumberOfReactionsInATick) {
  scenario_.duration_ticks = 4;
  expect_that("reaction", Reaction{.when = condition("can.car.Status.Mode == 3"),
                                   .then = condition("can.car.Status.Level == 1"),
                                   .within_ns = 20 * ms,
                                   .at_least = 50});
  frame(1, 0, 0);
  tick();
  for (int i = 0; i < 50; ++i) {
    frame(3, 0, ms + i);
    frame(1, 0, ms + i);
  }
  tick();
  frame(1, 1, 12 * ms);
  tick();
  EXPECT_EQ(result("reaction").result, Result::held) << result("reaction").detail;
  EXPECT_NE(result("reaction").detail.find("50 of 50 reactions in time"), std::string::npos)
      << result("reaction").detail;
  EXPECT_EQ(result_times("reaction").size(), 50U);
}

TEST_F(FramesAsInstants, AreSeenByStatisticsAndCurves) {
  const tests::TemporaryFolder folder;
  config::Diagnostics diagnostics;
  auto profile = signals::CsvProfile::read(folder.write("r.csv", "time,level\n0,5\n9,5\n"), {}, {"", {}},
                                           true, diagnostics);
  ASSERT_TRUE(profile) << diagnostics.to_text();
  Statistics largest{.signal = {"can.car.Status.Level", {}}, .limits = {}, .overshoot = {}, .settling = {}};
  largest.limits[Statistics::largest].max = condition("6");
  expect_that("largest", largest);
  expect_that("tracks", Tracks{.signal = {"can.car.Status.Level", {}},
                               .reference = std::make_shared<const signals::CsvProfile>(std::move(*profile)),
                               .reference_place = {},
                               .tolerance = condition("1"),
                               .max_shift_ns = 0,
                               .at_least = 2});
  frame(0, 5, 0);
  tick();
  frame(0, 5, 1 * ms);
  frame(0, 99, 4 * ms);
  frame(0, 5, 7 * ms);
  tick();
  tick();
  for (const char* name : {"largest", "tracks"}) {
    EXPECT_EQ(result(name).result, Result::failed) << result(name).detail;
    EXPECT_EQ(result(name).first_failure_ns, 4 * ms);
    EXPECT_EQ(result(name).evaluated_ticks, 3U);
  }
}

TEST_F(FramesAsInstants, MayAllBeRequestsOfATick) {
  scenario_.duration_ticks = 4;
  expect_that("response", Response{.request = {"can.car.Status.Mode", {}},
                                   .reply = {"can.car.Status.Level", {}},
                                   .within_ns = 20 * ms,
                                   .at_least = 50});
  tick();
  for (int i = 0; i < 50; ++i)
    device_.receive(0, i, ms + i);
  tick();
  for (int i = 0; i < 50; ++i)
    device_.receive(1, i, 12 * ms + i);
  tick();
  EXPECT_EQ(result("response").result, Result::held) << result("response").detail;
  EXPECT_EQ(result_times("response").size(), 50U);
}

/// Compares with a search over the list of all instants.
TEST_F(FramesAsInstants, OfReactionsAreThoseOfAList) {
  struct ListedInstant {
    std::int64_t time_ns;
    bool when, then;
  };
  const Reaction claim{condition("can.car.Status.Mode == 3"), condition("can.car.Status.Level == 1"),
                       15 * ms};
  expect_that("reaction", claim);
  std::mt19937 random(74);
  std::vector<ListedInstant> instants;
  const auto is_chosen = [&](unsigned percent) { return random() % 100 < percent; };
  double mode = 1, level = 0;
  for (std::int64_t tick_number = 0; tick_number < 100; ++tick_number) {
    const std::int64_t tick_ns = tick_number * scenario_.base_period_ns;
    const std::uint64_t frames = is_chosen(30) ? random() % 100 : random() % 3;
    for (std::uint64_t i = 0; tick_number == 0 ? i == 0 : i < frames; ++i) {
      mode = is_chosen(50) ? 3 : 1;
      level = is_chosen(2) ? 1 : 0;
      const std::int64_t time_ns =
          tick_number == 0 ? 0 : tick_ns - 9 * ms + static_cast<std::int64_t>(i) * ms / 20;
      frame(mode, level, time_ns);
      instants.push_back({time_ns, mode == 3, level == 1});
    }
    tick();
    instants.push_back({tick_ns, mode == 3, level == 1});
  }
  std::uint64_t begun = 0, in_time = 0, late = 0;
  for (std::size_t i = 0; i < instants.size(); ++i) {
    if (!instants[i].when || (i > 0 && instants[i - 1].when)) continue;
    ++begun;
    const std::int64_t limit_ns = instants[i].time_ns + claim.within_ns;
    std::size_t reply = i;
    while (reply < instants.size() && !instants[reply].then)
      ++reply;
    if (reply < instants.size() && instants[reply].time_ns <= limit_ns)
      ++in_time;
    else if (limit_ns <= instants.back().time_ns)
      ++late;
  }
  ASSERT_GT(begun, 300U);
  ASSERT_GT(late, 0U);
  const std::string expected =
      std::to_string(in_time) + " of " + std::to_string(in_time + late) + " reactions in time";
  EXPECT_NE(result("reaction").detail.find(expected), std::string::npos)
      << expected << ": " << result("reaction").detail;
  EXPECT_EQ(result("reaction").detail.find("open at once"), std::string::npos) << result("reaction").detail;
}

TEST_F(FramesAsInstants, AllocateNothing) {
  for (int i = 0; i < 20; ++i)
    expect_that(std::to_string(i), Never{condition("count(can.car.Status.Mode > " + std::to_string(i) +
                                                   ") > 5000 or computed > 5000")});
  frame(1, 0, 0);
  tick();
  for (int i = 0; i < 4'096; ++i)
    frame(i % 30, 0, ms + i);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  tick();
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_EQ(result("0").result, Result::held) << result("0").detail;
}

}  // namespace
}  // namespace hil::expectations
