// The values of stimuli, to the tick.

#include <numbers>

#include "injection_fixture.hpp"
#include "tests/support/allocation_guard.hpp"

namespace hil::injection {
namespace {

class Sequences : public test::InjectionFixture {
 protected:
  void drive(const std::string& sequence, const std::string& more = "") {
    open("stimuli: [{name: s, drives: control.u, sequence: [" + sequence + "]" + more + "}]\n");
  }
  double at(std::int64_t tick_ms) {
    run_to(tick_ms);
    EXPECT_EQ(value("control.u"), read("u").value);
    return value("control.u");
  }
};

TEST_F(Sequences, HoldIsAStep) {
  drive("{hold: 2 m, for: 3 ms}, {hold: 70 cm}", ", at: 2 ms");
  EXPECT_EQ(at(0), 5.0) << "the initial value of the input";
  EXPECT_EQ(at(1), 5.0);
  EXPECT_EQ(at(2), 2.0);
  EXPECT_EQ(at(4), 2.0);
  EXPECT_EQ(at(5), 0.7);
  EXPECT_EQ(at(500), 0.7);
  EXPECT_EQ(value("stimulus.s"), 1.0);
}

TEST_F(Sequences, HoldKeepsAndValueFollows) {
  drive("{hold: plant.x, for: 10 ms}, {value: 2 * plant.x}");
  EXPECT_EQ(at(9), 0.0);
  EXPECT_EQ(at(10), 18.0) << "of the tick before";
  EXPECT_EQ(at(30), 58.0);
}

TEST_F(Sequences, RampBeginsAtTheValueBefore) {
  drive("{ramp: 9 m, for: 4 ms}, {ramp: 1 m, for: 8 ms}, {hold: 3 m, for: 1 ms}");
  EXPECT_EQ(at(0), 5.0);
  EXPECT_EQ(at(1), 6.0);
  EXPECT_EQ(at(4), 9.0);
  EXPECT_EQ(at(6), 7.0);
  EXPECT_EQ(at(12), 3.0);
  EXPECT_EQ(at(13), 3.0) << "the last value stays";
}

TEST_F(Sequences, EndBetweenTicksAtTheirExactInstants) {
  drive("{ramp: 9 m, for: 2.5 ms}, {ramp: 1 m, for: 2.5 ms}");
  EXPECT_NEAR(at(2), 8.2, 1e-12);
  EXPECT_NEAR(at(3), 9.0 - 8.0 * 0.5 / 2.5, 1e-12);
  EXPECT_EQ(at(5), 1.0);
}

TEST_F(Sequences, ManyPartsInOneTick) {
  drive("{ramp: 6 m, for: 1 ms}, {ramp: 7 m, for: 1 ms}", ", repeat: 3");
  EXPECT_EQ(at(0), 5.0);
  time_ns_ = 20 * ms;  // ticks were skipped
  EXPECT_EQ(at(20), 7.0);
}

TEST_F(Sequences, PeriodicShapes) {
  drive(
      "{sine: {mean: 1 m, amplitude: 2 m, period: 8 ms, phase: 90 deg}, for: 16 ms},"
      "{sawtooth: {low: 0, high: 4 m, period: 4 ms}, for: 8 ms},"
      "{pulses: {low: 1 m, high: 3 m, period: 10 ms, width: 30 %}}");
  EXPECT_NEAR(at(0), 3.0, 1e-12);
  EXPECT_NEAR(at(1), 1.0 + std::numbers::sqrt2, 1e-12);
  EXPECT_NEAR(at(2), 1.0, 1e-12);
  EXPECT_NEAR(at(12), -1.0, 1e-12);
  EXPECT_EQ(at(16), 0.0);
  EXPECT_EQ(at(17), 1.0);
  EXPECT_EQ(at(19), 3.0);
  EXPECT_EQ(at(20), 0.0);
  EXPECT_EQ(at(24), 3.0);
  EXPECT_EQ(at(26), 3.0);
  EXPECT_EQ(at(27), 1.0);
  EXPECT_EQ(at(33), 1.0);
  EXPECT_EQ(at(34), 3.0);
}

TEST_F(Sequences, NoiseHasItsMeanAndDeviation) {
  drive("{noise: {mean: 10 m, deviation: 20 cm}}");
  double sum = 0.0, squares = 0.0;
  constexpr int ticks = 20'000;
  for (int i = 0; i < ticks; ++i) {
    const double u = at(i);
    sum += u;
    squares += (u - 10.0) * (u - 10.0);
  }
  EXPECT_NEAR(sum / ticks, 10.0, 0.01);
  EXPECT_NEAR(std::sqrt(squares / ticks), 0.2, 0.005);
}

TEST_F(Sequences, AmplitudesOfTemperaturesAreDifferences) {
  open(
      "stimuli: [{name: s, drives: control.t, sequence: [{sine: {mean: 300 K, amplitude: 10 K, period: 4 "
      "ms}}]}]\n");
  run_to(1);
  EXPECT_NEAR(value("control.t"), 36.85, 1e-9);
}

TEST_F(Sequences, RepeatAndNameTheirParts) {
  drive("{name: up, hold: 1 m, for: 2 ms}, {hold: 2 m, for: 1 ms}, {name: down, hold: 0, for: 2 ms}",
        ", repeat: 2, at: 1 ms");
  run_to(40);
  EXPECT_EQ(events(), (std::vector<std::string>{"1: stimulus s begins", "1: stimulus s: up begins",
                                                "4: stimulus s: down begins", "6: stimulus s: up begins",
                                                "9: stimulus s: down begins"}));
  EXPECT_EQ(value("control.u"), 0.0);
}

TEST_F(Sequences, BeginAnewAtEachBegin) {
  drive("{hold: 1 m, for: 2 ms}, {hold: 2 m, for: 100 ms}", ", at: 0 ms, for: 4 ms, every: 10 ms");
  EXPECT_EQ(at(1), 1.0);
  EXPECT_EQ(at(3), 2.0);
  EXPECT_EQ(at(9), 2.0) << "it keeps its value after its end";
  EXPECT_EQ(value("stimulus.s"), 0.0);
  EXPECT_EQ(at(10), 1.0);
  EXPECT_EQ(at(12), 2.0);
}

TEST_F(Sequences, DoNotAllocateInTheTick) {
  drive("{hold: 1 m, for: 2 ms}, {noise: {mean: 0, deviation: 1 m}, for: 2 ms}", ", repeat: 0, at: 0 ms");
  run_to(1);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (std::int64_t i = 2; i < 60; ++i) {
    wiring_->faults.end_tick(i * ms);
    wiring_->stimuli.begin_tick(i * ms);
    wiring_->faults.begin_tick(i * ms);
  }
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::injection
