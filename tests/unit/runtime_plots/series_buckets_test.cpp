#include "runtime/plots/series_buckets.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "tests/support/allocation_guard.hpp"

namespace hil::plots {
namespace {

using report::SignalPoint;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

/// The bucket's values in a list of points.
SignalPoint at(const std::vector<SignalPoint>& points, std::uint64_t bucket) {
  SignalPoint found;
  for (const SignalPoint& point : points)
    if (point.bucket <= bucket) found = point;
  return found;
}

TEST(SeriesBuckets, HasOnePointWhereAValueChangesAndOneAtTheEnd) {
  SeriesBuckets buckets(8);
  EXPECT_TRUE(buckets.points().empty());
  for (const double value : {1.0, 1.0, 2.0, 2.0, 2.0})
    buckets.add(static_cast<std::uint64_t>(buckets.points().empty() ? 0 : buckets.points().back().bucket + 1),
                value);
  EXPECT_EQ(buckets.ticks_per_bucket(), 1U);
  EXPECT_EQ(buckets.points(), (std::vector<SignalPoint>{{0, 1.0, 1.0}, {2, 2.0, 2.0}, {4, 2.0, 2.0}}));
}

TEST(SeriesBuckets, KeepsPeaksOfOneTickWhenBucketsAreMerged) {
  SeriesBuckets buckets(4);
  for (std::uint64_t tick = 0; tick < 16; ++tick)
    buckets.add(tick, tick == 9 ? 50.0 : tick == 14 ? -50.0 : 0.0);
  EXPECT_EQ(buckets.ticks_per_bucket(), 4U);
  EXPECT_EQ(buckets.points(), (std::vector<SignalPoint>{{0, 0.0, 0.0}, {2, 0.0, 50.0}, {3, -50.0, 0.0}}));
}

TEST(SeriesBuckets, HasNoValueWhereNoTickHasOne) {
  SeriesBuckets buckets(8);
  buckets.add(1, 3.0);  // tick 0 was skipped
  buckets.add(2, unknown);
  buckets.add(3, 3.0);
  const std::vector<SignalPoint> points = buckets.points();
  ASSERT_EQ(points.size(), 4U);
  EXPECT_TRUE(std::isnan(points[0].min));
  EXPECT_EQ(points[1], (SignalPoint{1, 3.0, 3.0}));
  EXPECT_TRUE(std::isnan(points[2].max));
  EXPECT_EQ(points[3], (SignalPoint{3, 3.0, 3.0}));
}

TEST(SeriesBuckets, AgreesWithAllValues) {
  std::mt19937 random(7);
  for (int round = 0; round < 200; ++round) {
    const std::size_t capacity = 2 * (1 + random() % 20);
    const std::uint64_t ticks = 1 + random() % 500;
    SeriesBuckets buckets(capacity);
    std::vector<double> values(ticks, unknown);
    for (std::uint64_t tick = 0; tick < ticks; ++tick) {
      if (random() % 10 == 0 && tick + 1 < ticks) continue;  // skipped
      values[tick] = random() % 5 == 0 ? unknown : static_cast<double>(random() % 7);
      buckets.add(tick, values[tick]);
    }
    const std::uint64_t width = buckets.ticks_per_bucket();
    EXPECT_TRUE(width == 1 || ticks > capacity * width / 2) << "buckets are merged before they are full";
    const std::vector<SignalPoint> points = buckets.points();
    EXPECT_EQ(points.back().bucket, (ticks - 1) / width);
    for (std::uint64_t bucket = 0; bucket <= points.back().bucket; ++bucket) {
      double low = unknown, high = unknown;
      for (std::uint64_t tick = bucket * width; tick < std::min(ticks, (bucket + 1) * width); ++tick) {
        low = std::fmin(low, values[tick]);
        high = std::fmax(high, values[tick]);
      }
      const SignalPoint found = at(points, bucket);
      EXPECT_TRUE(found.min == low || (std::isnan(found.min) && std::isnan(low))) << bucket;
      EXPECT_TRUE(found.max == high || (std::isnan(found.max) && std::isnan(high))) << bucket;
    }
  }
}

TEST(SeriesBuckets, DoNotAllocateInTheTick) {
  SeriesBuckets buckets(64);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (std::uint64_t tick = 0; tick < 10'000; ++tick)
    buckets.add(tick, static_cast<double>(tick));
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

}  // namespace
}  // namespace hil::plots
