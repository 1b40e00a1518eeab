// The slices of sweeps, with and without skipped releases and missing answers.

#include "runtime/modules/laser_scanner/sweep_clock.hpp"

#include <gtest/gtest.h>

namespace hil::modules {
namespace {

constexpr std::int64_t step_ns = 10;

/// 12 columns of 2 beams in 4 steps: 6 beams in a slice.
class SweepClockTest : public ::testing::Test {
 protected:
  SweepClockTest() { clock_.set_first_release(first_ns_); }

  /// The step number `step` after the first release.
  bool advance(std::int64_t step) { return clock_.advance(first_ns_ + step * step_ns, step_ns); }

  const std::int64_t first_ns_ = 7;
  const ScanPattern pattern_{{.columns = 12,
                              .rows = 2,
                              .horizontal_rad = 1.0,
                              .vertical_rad = 0.5,
                              .elevation_rad = 0.0,
                              .period_ns = 4 * step_ns,
                              .left_to_right = true}};
  SweepClock clock_{pattern_};
};

TEST_F(SweepClockTest, SlicesFollowOneAnother) {
  EXPECT_EQ(clock_.sweeps(), 0U);
  for (std::int64_t step = 0; step < 12; ++step) {
    EXPECT_EQ(advance(step), step % 4 == 0) << step;
    EXPECT_EQ(clock_.sweep_number(), step / 4);
    EXPECT_EQ(clock_.sweeps(), static_cast<std::uint64_t>(step / 4 + 1));
    EXPECT_EQ(clock_.sweep_begin_ns(), first_ns_ + step / 4 * 4 * step_ns);
    EXPECT_EQ(clock_.first_beam(), static_cast<std::uint64_t>(step % 4 * 6));
    EXPECT_EQ(clock_.beam_count(), 6U);
    EXPECT_EQ(clock_.end_beam(), clock_.first_beam() + 6);
    EXPECT_EQ(clock_.ends_sweep(), step % 4 == 3);
    EXPECT_EQ(clock_.has_answers(), step % 4 != 0);
    EXPECT_TRUE(clock_.is_complete());
    for (std::uint64_t beam = clock_.first_beam(); beam < clock_.end_beam(); ++beam) {
      EXPECT_GE(clock_.beam_time_ns(beam), first_ns_ + step * step_ns);
      EXPECT_LT(clock_.beam_time_ns(beam), first_ns_ + (step + 1) * step_ns);
    }
    clock_.note_answers();
  }
}

TEST_F(SweepClockTest, SkippedReleaseMakesItsSweepIncomplete) {
  EXPECT_TRUE(advance(0));
  EXPECT_FALSE(advance(2));
  EXPECT_EQ(clock_.first_beam(), 12U);
  EXPECT_FALSE(clock_.is_complete());
  EXPECT_FALSE(advance(3));
  EXPECT_FALSE(clock_.is_complete());
  EXPECT_TRUE(advance(4));
  EXPECT_TRUE(clock_.is_complete()) << "the next sweep has all slices";
}

TEST_F(SweepClockTest, SweepWhoseFirstReleaseIsSkippedBeginsAtItsTime) {
  advance(0);
  clock_.note_answers();
  EXPECT_TRUE(advance(9)) << "the second slice of the third sweep";
  EXPECT_EQ(clock_.sweep_begin_ns(), first_ns_ + 8 * step_ns);
  EXPECT_EQ(clock_.sweep_number(), 2);
  EXPECT_EQ(clock_.sweeps(), 2U) << "no slice of the second sweep was reached";
  EXPECT_EQ(clock_.first_beam(), 6U);
  EXPECT_FALSE(clock_.has_answers());
  EXPECT_FALSE(clock_.is_complete());
}

TEST_F(SweepClockTest, MissingAnswersMakeTheirSweepIncomplete) {
  advance(0);
  clock_.note_missing_answers();
  EXPECT_FALSE(clock_.is_complete());
  advance(1);
  clock_.note_answers();
  EXPECT_TRUE(clock_.has_answers());
  EXPECT_FALSE(clock_.is_complete());
  advance(4);
  EXPECT_TRUE(clock_.is_complete());
}

/// A scanner with few beams has steps in which none leaves.
TEST_F(SweepClockTest, SliceMayBeEmpty) {
  const ScanPattern few{{.columns = 2,
                         .rows = 1,
                         .horizontal_rad = 1.0,
                         .vertical_rad = 0.5,
                         .elevation_rad = 0.0,
                         .period_ns = 4 * step_ns,
                         .left_to_right = true}};
  SweepClock clock(few);
  const std::uint32_t counts[] = {1, 0, 1, 0};
  for (std::int64_t step = 0; step < 4; ++step) {
    clock.advance(step * step_ns, step_ns);
    EXPECT_EQ(clock.beam_count(), counts[step]) << step;
    EXPECT_TRUE(clock.is_complete());
  }
  EXPECT_TRUE(clock.ends_sweep());
}

}  // namespace
}  // namespace hil::modules
