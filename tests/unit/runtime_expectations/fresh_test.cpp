// Freshness of received signals and messages as an expectation.

#include "runtime/expectations/fresh.hpp"

#include <gtest/gtest.h>

#include "tests/unit/runtime_expectations/judged_signals.hpp"

namespace hil::expectations {
namespace {

class Freshness : public Expectations {
 protected:
  const signals::SignalId mode_ = table_.add({.name = "can.car.Status.Mode",
                                              .unit = "",
                                              .writer = "can.car",
                                              .arrives = true,
                                              .timeout_ns = 5 * ms});
  const signals::SignalId fresh_ =
      table_.add({.name = "can.car.Status.fresh", .unit = "", .writer = "can.car"});

  /// A tick, with the time of the newest frame.
  void tick(Judge& judge, std::int64_t tick, std::optional<std::int64_t> frame_ms) {
    if (frame_ms) {
      const bool is_fresh = (tick - *frame_ms) * ms <= 5 * ms;
      table_.write(mode_, {.value = 1.0, .time_ns = *frame_ms * ms, .fresh = is_fresh});
      table_.write(fresh_, is_fresh ? 1.0 : 0.0, tick * ms);
    }
    judge.check(table_, {.time_ns = tick * ms});
  }
};

TEST_F(Freshness, IsJudgedFromTheFirstArrivalOn) {
  for (const char* name : {"can.car.Status", "can.car.Status.Mode"}) {
    table_.write(mode_, signals::SignalValue{});
    table_.write(fresh_, 0.0, 0);
    const auto judge = this->judge(Fresh{{name, {}}});
    for (std::int64_t i = 0; i < 4; ++i)
      tick(*judge, i, std::nullopt);
    for (std::int64_t i = 4; i < 8; ++i)
      tick(*judge, i, 4);
    const auto result = expect(*judge, until(8 * ms, 8), Result::held);
    EXPECT_EQ(result.detail, std::string("fresh ") + name + ": at most 3.00 ms old, at 0.007 s");
    EXPECT_DOUBLE_EQ(result.margin, 0.002);
    EXPECT_EQ(result.margin_unit, "s");
    EXPECT_EQ(result.worst_ns, 7 * ms);
    EXPECT_EQ(result.covered_ticks, 4U);
  }
}

TEST_F(Freshness, FailsAtTheTickOnWhichItEnds) {
  const auto judge = this->judge(Fresh{{"can.car.Status", {}}});
  for (std::int64_t i = 0; i < 12; ++i)
    tick(*judge, i, 0);
  tick(*judge, 12, 12);
  const auto result = expect(*judge, until(13 * ms, 13), Result::failed, {"not fresh at 0.006 s"});
  EXPECT_EQ(result.first_failure_ns, 6 * ms);
  EXPECT_DOUBLE_EQ(result.margin, -0.006);
  EXPECT_EQ(result.worst_ns, 11 * ms);
}

TEST_F(Freshness, OfWhatNeverArrivedIsNotChecked) {
  const auto judge = this->judge(Fresh{{"can.car.Status", {}}});
  tick(*judge, 0, std::nullopt);
  expect(*judge, until(ms, 1), Result::not_checked, {"it never arrived"});
}

}  // namespace
}  // namespace hil::expectations
