// Signals that follow a reference curve.

#include "runtime/expectations/tracks.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/allocation_guard.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

class Tracking : public Expectations {
 protected:
  Tracks claim(const std::string& csv, const std::string& tolerance, std::int64_t shift_ms = 0) {
    config::Diagnostics diagnostics;
    auto profile = signals::CsvProfile::read(folder_.write("r.csv", csv), {}, {"", {}}, true, diagnostics);
    if (!profile) throw std::runtime_error(diagnostics.to_text());
    return {.signal = {"ego.speed", {}},
            .reference = std::make_shared<const signals::CsvProfile>(std::move(*profile)),
            .reference_place = {},
            .tolerance = condition(tolerance),
            .max_shift_ns = shift_ms * ms,
            .at_least = 2};
  }
  static constexpr const char* ramp = "time,speed\n0,0\n0.1,10\n";  // 0.1 m/s in a tick

  const tests::TemporaryFolder folder_;
};

TEST_F(Tracking, IsHeldWithinTheTolerance) {
  const auto judge = this->judge(claim(ramp, "0.5 m/s"));
  for (int tick = 0; tick < 50; ++tick)
    set_speed(*judge, 0.1 * tick + (tick == 20 ? -0.4 : 0.1), tick * ms);
  const auto result = expect(*judge, until(50 * ms, 50), Result::held);
  EXPECT_EQ(result.detail,
            "ego.speed tracks its reference within 0.5 m/s: greatest error 0.4 m/s at 0.020 s; 50 instants "
            "were compared, from 0 to 49 ms");
  EXPECT_NEAR(result.margin, 0.1, 1e-12);
  EXPECT_EQ(result.margin_unit, "m/s");
  EXPECT_EQ(result.worst_ns, 20 * ms);
  EXPECT_EQ(result.covered_ticks, 50U);
}

TEST_F(Tracking, FailsAtTheFirstTickBeyondIt) {
  const auto judge = this->judge(claim(ramp, "1.8 km/h"));
  for (int tick = 0; tick < 50; ++tick)
    set_speed(*judge, 0.1 * tick + (tick >= 20 ? 0.05 * (tick - 9) : 0.0), tick * ms);
  const auto result = expect(*judge, until(50 * ms, 50), Result::failed);
  EXPECT_EQ(result.first_failure_ns, 20 * ms);
  EXPECT_NEAR(result.margin, 0.5 - 2.0, 1e-12);
  EXPECT_EQ(result.worst_ns, 49 * ms);
}

TEST_F(Tracking, FindsTheBestShift) {
  const char* const triangle = "time,speed\n0,0\n0.05,10\n0.1,0\n";
  const auto value = [](int tick) { return 10.0 - std::abs(tick - 50) * 0.2; };
  for (const int shift : {7, -4, 0}) {
    const auto judge = this->judge(claim(triangle, "0.1 m/s", 10));
    for (int tick = 0; tick < 100; ++tick)
      set_speed(*judge, value(tick - shift), tick * ms);
    const auto result = expect(*judge, until(100 * ms, 100), Result::held);
    EXPECT_NE(result.detail.find("after a shift of " + std::to_string(shift) + " ms"), std::string::npos)
        << result.detail;
    EXPECT_NEAR(result.margin, 0.1, 1e-9);
    EXPECT_EQ(result.covered_ticks, 81U) << "the ends of the reference are not judged";
  }
  const auto late = this->judge(claim(triangle, "0.1 m/s", 5));
  for (int tick = 0; tick < 100; ++tick)
    set_speed(*late, value(tick - 7), tick * ms);
  EXPECT_NEAR(expect(*late, until(100 * ms, 100), Result::failed, {"after a shift of 5 ms"}).margin, -0.3,
              1e-9);
}

TEST_F(Tracking, IsNotCheckedWhereItsSignalIsUnknown) {
  const auto judge = this->judge(claim(ramp, "1 m/s"));
  for (int tick = 0; tick < 20; ++tick)
    set_speed(*judge, tick < 10 ? std::nan("") : 0.1 * tick, tick * ms);
  expect(*judge, until(20 * ms, 20), Result::not_checked, {"evaluated on 10 of 20 ticks"});
}

TEST_F(Tracking, OutsideTheReferenceIsNotJudged) {
  const auto judge = this->judge(claim("time,speed\n0.01,1\n0.02,1\n", "1 m/s"));
  for (int tick = 0; tick < 40; ++tick)
    set_speed(*judge, tick >= 10 && tick <= 20 ? 1.0 : 50.0, tick * ms);
  const auto result = expect(*judge, until(40 * ms, 40), Result::held);
  EXPECT_EQ(result.covered_ticks, 11U);
  const auto ended = this->judge(claim("time,speed\n0.01,1\n0.02,1\n", "1 m/s"));
  set_speed(*ended, 0, 0);
  expect(*ended, until(5 * ms, 5), Result::not_checked, {"the reference has no value on a tick"});
}

TEST_F(Tracking, OneInstantIsNoCurve) {
  const auto once = judge(claim("time,speed\n0.003,5\n0.0035,6\n", "1 m/s"));
  for (int tick = 0; tick < 9; ++tick)
    set_speed(*once, 5.0, tick * ms);
  expect(*once, until(9 * ms, 9), Result::not_checked,
         {"1 instant was compared, at 3 ms; at least 2 are required (at_least)"});
  const auto wrong = judge(claim("time,speed\n0.003,5\n0.0035,6\n", "1 m/s"));
  for (int tick = 0; tick < 9; ++tick)
    set_speed(*wrong, 9.0, tick * ms);
  expect(*wrong, until(9 * ms, 9), Result::failed, {"1 instant was compared"});
  const auto twice = judge(claim("time,speed\n0.003,5\n0.004,5\n", "1 m/s"));
  for (int tick = 0; tick < 9; ++tick)
    set_speed(*twice, 5.0, tick * ms);
  expect(*twice, until(9 * ms, 9), Result::held, {"2 instants were compared, from 3 ms to 4 ms"});
}

TEST_F(Tracking, IsNotCheckedWithFewerThanAtLeastInstants) {
  for (const int instants : {19, 20}) {
    Tracks tracks = claim(ramp, "1 m/s");
    tracks.at_least = 20;
    const auto judge = this->judge(tracks);
    for (int tick = 0; tick < instants; ++tick)
      set_speed(*judge, 0.1 * tick, tick * ms);
    const auto result = judge->result(until(instants * ms, static_cast<std::uint64_t>(instants)));
    EXPECT_EQ(result.result, instants < 20 ? Result::not_checked : Result::held) << result.detail;
  }
}

TEST_F(Tracking, IsJudgedWithoutAllocation) {
  const auto judge = this->judge(claim(ramp, "1 m/s", 20));
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int tick = 0; tick < 100; ++tick)
    set_speed(*judge, 0.1 * tick, tick * ms);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

/// At a frame the reference is that of its time, also between rows that are closer than ticks.
TEST_F(Tracking, JudgesFrames) {
  const char* const fine = "time,speed\n0,0\n0.0101,0\n0.0102,7\n0.0103,0\n0.1,0\n";
  for (const std::int64_t shift_ms : {0, 2}) {
    for (const auto& [at_us, value, expected] : {std::tuple{10'200, 7.0, Result::held},
                                                 {10'200, 0.0, shift_ms == 0 ? Result::failed : Result::held},
                                                 {20'500, 9.0, Result::failed},
                                                 {20'500, 0.2, Result::held}}) {
      const auto judge = this->judge(claim(fine, "0.5 m/s", shift_ms));
      for (int tick = 0; tick < 50; ++tick) {
        const std::int64_t frame_ns = at_us * 1'000L;
        if (frame_ns > (tick - 1) * ms && frame_ns <= tick * ms) {
          table_.write(speed_, value, frame_ns);
          judge->check(table_, {.time_ns = frame_ns, .is_tick = false});
        }
        set_speed(*judge, 0.0, tick * ms);
      }
      const auto result = judge->result(until(50 * ms, 50));
      EXPECT_EQ(result.result, expected) << value << " at " << at_us << " us: " << result.detail;
      EXPECT_EQ(result.evaluated_ticks, shift_ms == 0 ? 50U : 48U);
    }
  }
}

}  // namespace
}  // namespace hil::expectations
