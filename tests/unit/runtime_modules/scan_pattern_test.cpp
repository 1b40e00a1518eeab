#include "runtime/modules/laser_scanner/scan_pattern.hpp"

#include <glm/ext/vector_double3.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace hil::modules {
namespace {

constexpr double degree = 3.14159265358979323846 / 180.0;
constexpr std::int64_t second_ns = 1'000'000'000;

PatternOptions paper_options() {
  return {.columns = 480,
          .rows = 270,
          .horizontal_rad = 140.0 * degree,
          .vertical_rad = 40.0 * degree,
          .elevation_rad = 0.0,
          .period_ns = second_ns,
          .left_to_right = true};
}

TEST(ScanPattern, BeamsTakeExactlyOnePeriod) {
  for (const std::int64_t period_ns : {second_ns, std::int64_t{333'333'333}, std::int64_t{10'000'000'000}}) {
    PatternOptions options = paper_options();
    options.period_ns = period_ns;
    const ScanPattern pattern(options);
    ASSERT_EQ(pattern.beams(), 480U * 270U);
    EXPECT_EQ(pattern.time_ns(0), 0);
    std::int64_t before_ns = -1;
    for (std::uint64_t beam = 0; beam < pattern.beams(); ++beam) {
      const std::int64_t time_ns = pattern.time_ns(beam);
      ASSERT_GT(time_ns, before_ns);
      // Equal distances: never off by a whole nanosecond.
      const double exact_ns =
          static_cast<double>(beam) * static_cast<double>(period_ns) / static_cast<double>(pattern.beams());
      ASSERT_LT(std::abs(static_cast<double>(time_ns) - exact_ns), 1.0);
      before_ns = time_ns;
    }
    EXPECT_LT(before_ns, period_ns);
    EXPECT_EQ(pattern.time_ns(pattern.beams()), period_ns);
  }
}

TEST(ScanPattern, SlicesContainEveryBeamOnce) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 200; ++round) {
    PatternOptions options = paper_options();
    options.columns = std::uniform_int_distribution<std::uint32_t>(2, 700)(random);
    options.rows = std::uniform_int_distribution<std::uint32_t>(1, 90)(random);
    const auto slices = std::uniform_int_distribution<std::int64_t>(1, 1500)(random);
    const auto slice_ns = std::uniform_int_distribution<std::int64_t>(1, 10'000'000)(random);
    options.period_ns = slices * slice_ns;
    const ScanPattern pattern(options);
    std::uint64_t next = 0;
    for (std::int64_t i = 0; i < slices; ++i) {
      ASSERT_EQ(pattern.first_beam_at(i * slice_ns), next) << "gap or overlap";
      const std::uint64_t end = pattern.first_beam_at((i + 1) * slice_ns);
      ASSERT_GE(end, next);
      if (end > next) {
        // Every beam of the slice leaves within it.
        ASSERT_GE(pattern.time_ns(next), i * slice_ns);
        ASSERT_LT(pattern.time_ns(end - 1), (i + 1) * slice_ns);
      }
      next = end;
    }
    ASSERT_EQ(next, pattern.beams());
  }
}

TEST(ScanPattern, LargestSweepDoesNotOverflow) {
  PatternOptions options = paper_options();
  options.columns = 16384;
  options.rows = 8192;
  options.period_ns = 10'000'000'000;
  const ScanPattern pattern(options);
  EXPECT_EQ(pattern.first_beam_at(options.period_ns), pattern.beams());
  EXPECT_EQ(pattern.first_beam_at(options.period_ns / 2), pattern.beams() / 2);
  EXPECT_LT(pattern.time_ns(pattern.beams() - 1), options.period_ns);
  EXPECT_GT(pattern.time_ns(pattern.beams() - 1), options.period_ns - 100);
}

TEST(ScanPattern, ColumnsCrossTheFieldOfViewInTheGivenDirection) {
  for (const bool left_to_right : {true, false}) {
    PatternOptions options = paper_options();
    options.left_to_right = left_to_right;
    const ScanPattern pattern(options);
    const double half_pitch = 0.5 * pattern.pitch_rad();
    const double first = (left_to_right ? 1.0 : -1.0) * (70.0 * degree - half_pitch);
    EXPECT_NEAR(pattern.azimuth_rad(0), first, 1e-12);
    EXPECT_NEAR(pattern.azimuth_rad(479), -first, 1e-12);
    EXPECT_NEAR(pattern.pitch_rad(), 140.0 / 480.0 * degree, 1e-15);
    for (std::uint32_t c = 1; c < 480; ++c) {
      ASSERT_NEAR(pattern.azimuth_rad(c) - pattern.azimuth_rad(c - 1),
                  left_to_right ? -pattern.pitch_rad() : pattern.pitch_rad(), 1e-12);
    }
  }
}

TEST(ScanPattern, RowsAscendAroundTheirElevation) {
  PatternOptions options = paper_options();
  options.elevation_rad = 5.0 * degree;
  const ScanPattern pattern(options);
  const double half_pitch = 0.5 * 40.0 / 270.0 * degree;
  EXPECT_NEAR(pattern.elevation_rad(0), -15.0 * degree + half_pitch, 1e-12);
  EXPECT_NEAR(pattern.elevation_rad(269), 25.0 * degree - half_pitch, 1e-12);
  for (std::uint32_t r = 1; r < 270; ++r)
    ASSERT_GT(pattern.elevation_rad(r), pattern.elevation_rad(r - 1));
}

TEST(ScanPattern, DirectionsAreUnitVectorsWithTheAnglesOfTheBeam) {
  const ScanPattern pattern(paper_options());
  for (std::uint32_t c = 0; c < 480; c += 7) {
    for (std::uint32_t r = 0; r < 270; r += 11) {
      const glm::dvec3 d = pattern.direction(c, r);
      ASSERT_NEAR(glm::length(d), 1.0, 1e-6);
      ASSERT_NEAR(std::atan2(d.y, d.x), pattern.azimuth_rad(c), 1e-6);
      ASSERT_NEAR(std::asin(d.z), pattern.elevation_rad(r), 1e-6);
    }
  }
}

TEST(ScanPattern, BeamPassesEachColumnInTheMiddleOfItsTime) {
  for (const bool left_to_right : {true, false}) {
    PatternOptions options = paper_options();
    options.left_to_right = left_to_right;
    const ScanPattern pattern(options);
    for (std::uint32_t c = 0; c < 480; ++c) {
      ASSERT_NEAR(pattern.beam_azimuth_rad((c + 0.5) / 480.0), pattern.azimuth_rad(c), 1e-12);
      // The beams of a column leave while the beam is within half a pitch of it.
      const double begin_s =
          static_cast<double>(pattern.time_ns(std::uint64_t{c} * 270)) / static_cast<double>(second_ns);
      ASSERT_LE(std::abs(pattern.beam_azimuth_rad(begin_s) - pattern.azimuth_rad(c)),
                0.5 * pattern.pitch_rad() + 1e-8);
    }
    const double sign = left_to_right ? 1.0 : -1.0;
    EXPECT_NEAR(pattern.beam_azimuth_rad(0.0), sign * 70.0 * degree, 1e-12);
    EXPECT_NEAR(pattern.beam_azimuth_rad(1.0), -sign * 70.0 * degree, 1e-12);
  }
}

TEST(ScanPattern, BeamsAreNumberedColumnByColumn) {
  const ScanPattern pattern(paper_options());
  EXPECT_EQ(pattern.column_of(0), 0U);
  EXPECT_EQ(pattern.row_of(0), 0U);
  EXPECT_EQ(pattern.column_of(269), 0U);
  EXPECT_EQ(pattern.row_of(269), 269U);
  EXPECT_EQ(pattern.column_of(270), 1U);
  EXPECT_EQ(pattern.row_of(270), 0U);
}

}  // namespace
}  // namespace hil::modules
