// When stimuli and faults are active, to the tick.

#include "injection_fixture.hpp"

namespace hil::injection {
namespace {

class Activations : public test::InjectionFixture {
 protected:
  /// The ticks, as "3-6 9-11", in which a fault with these keys is active, of the first 40.
  std::string active_ticks(const std::string& keys) {
    open("faults: [{name: f, signal: plant.x, offset: 1 m, " + keys + "}]\n");
    std::string ticks;
    bool was_active = false;
    for (std::int64_t i = 0; i <= 40; ++i) {
      run_to(i);
      const bool is_active = i < 40 && value("fault.f") == 1.0;
      EXPECT_EQ(is_active, i < 40 && value("plant.x.faulted") == value("plant.x") + 1.0) << i;
      if (is_active != was_active)
        ticks += is_active ? (ticks.empty() ? "" : " ") + std::to_string(i) : "-" + std::to_string(i - 1);
      was_active = is_active;
    }
    return ticks;
  }
};

TEST_F(Activations, WithoutAnyKeyLastTheWholeRun) {
  EXPECT_EQ(active_ticks("probability: 100 %"), "0-39");
}

TEST_F(Activations, BeginAndEndByTime) {
  EXPECT_EQ(active_ticks("at: 3 ms"), "3-39");
}

TEST_F(Activations, BeginInTheFirstTickThatIsNotBefore) {
  EXPECT_EQ(active_ticks("at: 3.1 ms, for: 2 ms"), "4-5");
}

TEST_F(Activations, RepeatByTime) {
  EXPECT_EQ(active_ticks("at: 3 ms, for: 2 ms, every: 10 ms, times: 3"), "3-4 13-14 23-24");
}

TEST_F(Activations, RepeatWithoutEnd) {
  EXPECT_EQ(active_ticks("at: 0 ms, for: 1 ms, every: 10 ms"), "0-0 10-10 20-20 30-30");
}

// x is the number of the tick before, when a tick begins.
TEST_F(Activations, BeginWhereAConditionBecomesTrue) {
  EXPECT_EQ(active_ticks("when: plant.x >= 7 m, for: 4 ms"), "8-11");
}

TEST_F(Activations, BeginAgainWhereTheConditionBecomesTrueAgain) {
  EXPECT_EQ(active_ticks("when: 'mod(plant.x, 10 m) >= 7 m', for: 1 ms, times: 2"), "8-8 18-18");
}

TEST_F(Activations, EndByACondition) {
  EXPECT_EQ(active_ticks("at: 2 ms, until: plant.x >= 7 m"), "2-7");
}

TEST_F(Activations, LastWhileAConditionIsTrue) {
  EXPECT_EQ(active_ticks("while: 'mod(plant.x, 10 m) >= 7 m'"), "8-10 18-20 28-30 38-39");
}

TEST_F(Activations, FollowOneAnother) {
  open(
      "faults:\n"
      "  - {name: a, signal: plant.x, gain: 2, at: 3 ms, for: 4 ms}\n"
      "  - {name: b, signal: plant.x, gain: 3, when: fall(fault.a == 1), for: 2 ms}\n");
  run_to(39);
  EXPECT_EQ(events(),
            (std::vector<std::string>{"3: fault a begins: plant.x multiplied by 2", "7: fault a ends",
                                      "8: fault b begins: plant.x multiplied by 3", "10: fault b ends"}));
}

TEST_F(Activations, BeginWithTheirProbability) {
  open(
      "faults: [{name: f, signal: plant.x, gain: 2, at: 0 ms, for: 1 ms, every: 2 ms, probability: 30 %}]\n");
  run_to(20'000);
  report::RunRecord record;
  wiring_->faults.fill(time_ns_, record);
  EXPECT_NEAR(static_cast<double>(record.faults[0].begins), 3000.0, 150.0);
  EXPECT_EQ(record.faults[0].active_ns, static_cast<std::int64_t>(record.faults[0].begins) * ms);
}

TEST_F(Activations, ReportTheSpansInWhichTheyWereActive) {
  open("faults: [{name: f, signal: plant.x, gain: 2, at: 2 ms, for: 3 ms, every: 10 ms}]\n");
  run_to(23);
  report::RunRecord record;
  wiring_->faults.fill(time_ns_, record);
  EXPECT_EQ(record.faults[0].spans,
            (std::vector<report::ActiveSpan>{{2 * ms, 5 * ms}, {12 * ms, 15 * ms}, {22 * ms, 24 * ms}}));
  run_to(5'000);
  report::RunRecord later;
  wiring_->faults.fill(time_ns_, later);
  EXPECT_EQ(later.faults[0].spans.size(), Activation::max_spans);
  EXPECT_EQ(later.faults[0].spans.back(), (report::ActiveSpan{992 * ms, 995 * ms}));
}

TEST_F(Activations, OfAnUnknownConditionDoNotBegin) {
  EXPECT_EQ(active_ticks("when: plant.x / 0 > 1 m"), "");
}

}  // namespace
}  // namespace hil::injection
