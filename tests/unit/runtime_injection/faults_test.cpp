// What the readers of a faulted signal read, to the tick.

#include "injection_fixture.hpp"
#include "tests/support/allocation_guard.hpp"

namespace hil::injection {
namespace {

class Faults : public test::InjectionFixture {
 protected:
  void fault(const std::string& keys) { open("faults: [{name: f, signal: plant.x, " + keys + "}]\n"); }
  /// What control reads in a tick, in which plant has written the tick's number.
  double at(std::int64_t tick_ms) {
    run_to(tick_ms);
    EXPECT_EQ(value("plant.x"), static_cast<double>(tick_ms)) << "the true value";
    EXPECT_TRUE(value("plant.x.faulted") == read("x").value || std::isnan(read("x").value));
    return read("x").value;
  }
};

TEST_F(Faults, AreFollowedInTheTickOfAWrite) {
  fault("gain: 2, at: 0 ms");
  EXPECT_EQ(at(3), 6.0);
  EXPECT_TRUE(read("x").fresh);
}

TEST_F(Faults, StuckAtTheLastValueBefore) {
  fault("stuck: last, at: 5 ms, for: 10 ms");
  EXPECT_EQ(at(4), 4.0);
  EXPECT_EQ(at(5), 4.0) << "the last value before the fault";
  EXPECT_EQ(at(14), 4.0);
  EXPECT_EQ(at(15), 15.0);
}

TEST_F(Faults, StuckAtAValue) {
  fault("stuck: 2 * plant.x + 20 cm, at: 5 ms");
  EXPECT_EQ(at(4), 4.0);
  EXPECT_NEAR(at(5), 8.2, 1e-12) << "computed when the tick begins";
}

TEST_F(Faults, OffsetAndDrift) {
  open(
      "faults:\n  - {name: a, signal: plant.x, offset: 50 cm, at: 2 ms}\n"
      "  - {name: b, signal: plant.x, drift: 1 m/s, at: 10 ms}\n");
  EXPECT_EQ(at(2), 2.5);
  EXPECT_EQ(at(10), 10.5);
  EXPECT_NEAR(at(110), 110.6, 1e-9);
}

TEST_F(Faults, ActInTheOrderOfTheScenario) {
  open("faults:\n  - {name: a, signal: plant.x, offset: 1 m}\n  - {name: b, signal: plant.x, gain: 2}\n");
  EXPECT_EQ(at(3), 8.0);
}

TEST_F(Faults, Delay) {
  fault("delay: 4 ms, at: 10 ms, for: 10 ms");
  EXPECT_EQ(at(9), 9.0);
  EXPECT_EQ(at(10), 6.0);
  EXPECT_EQ(at(19), 15.0);
  EXPECT_EQ(at(20), 20.0);
}

TEST_F(Faults, DelayFromTheStartHasTheFirstValue) {
  fault("delay: 4 ms");
  EXPECT_EQ(at(2), 0.0);
  EXPECT_EQ(at(4), 0.0);
  EXPECT_EQ(at(5), 1.0);
}

TEST_F(Faults, Noise) {
  fault("noise: 10 cm");
  double sum = 0.0, squares = 0.0;
  constexpr int ticks = 20'000;
  for (int i = 0; i < ticks; ++i) {
    const double error = at(i) - i;
    sum += error;
    squares += error * error;
  }
  EXPECT_NEAR(sum / ticks, 0.0, 0.005);
  EXPECT_NEAR(std::sqrt(squares / ticks), 0.1, 0.003);
}

TEST_F(Faults, DropoutHasNoValue) {
  fault("dropout: 25 %");
  int dropped = 0;
  for (int i = 0; i < 8'000; ++i) {
    if (!std::isnan(at(i))) continue;
    ++dropped;
    EXPECT_FALSE(read("x").fresh);
  }
  EXPECT_NEAR(dropped, 2'000, 160);
}

TEST_F(Faults, OfNamedReadersLeaveTheOthers) {
  open("faults: [{name: f, signal: plant.x, gain: 2, readers: [control.x]}]\nvariables: {v: plant.x}\n");
  EXPECT_EQ(at(3), 6.0);
  end_tick();
  EXPECT_EQ(value("v"), 3.0) << "variables read the true value";
}

TEST_F(Faults, OfAStimulus) {
  open(
      "stimuli: [{name: s, drives: control.u, sequence: [{hold: 1 m}]}]\n"
      "faults: [{name: f, signal: control.u, offset: 2 m, at: 3 ms}]\n");
  run_to(4);
  EXPECT_EQ(value("control.u"), 1.0);
  EXPECT_EQ(read("u").value, 3.0);
}

TEST_F(Faults, OfTemperaturesHaveOffsetsInKelvin) {
  open(
      "stimuli: [{name: s, drives: control.t, sequence: [{hold: 20 degC}]}]\n"
      "faults: [{name: f, signal: control.t, offset: 5 K}]\n");
  run_to(1);
  EXPECT_NEAR(read("t").value, 25.0, 1e-9);
}

TEST_F(Faults, OfTemperaturesHaveDegreesAsDifferences) {
  open(
      "stimuli: [{name: s, drives: control.t, sequence: [{hold: 20 degC}]}]\n"
      "faults: [{name: f, signal: control.t, offset: -5 degC}, {name: g, signal: control.t, offset: 18 "
      "degF},\n"
      "  {name: h, signal: control.t, noise: 0.001 degC}]\n");
  run_to(1);
  EXPECT_NEAR(read("t").value, 25.0, 0.05);
}

TEST_F(Faults, DoNotAllocateInTheTick) {
  open(
      "faults:\n  - {name: a, signal: plant.x, delay: 5 ms, at: 3 ms, for: 2 ms, every: 5 ms}\n"
      "  - {name: b, signal: plant.x, noise: 1 m, while: plant.x > 5 m}\n"
      "  - {name: c, signal: plant.x, stuck: last, when: fault.a == 1, for: 1 ms, times: 9}\n");
  run_to(1);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (std::int64_t i = 2; i < 60; ++i) {
    wiring_->faults.end_tick(i * ms);
    wiring_->faults.begin_tick(i * ms);
  }
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::injection
