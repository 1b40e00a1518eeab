#include "runtime/executive/histogram.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

namespace hil::executive {
namespace {

TEST(Histogram, QuantilesOfNoValueAndOfOneValue) {
  Histogram histogram;
  EXPECT_EQ(histogram.quantile_ns(0.5), 0);
  EXPECT_EQ(histogram.max_ns(), 0);
  histogram.record(123'456'789);
  for (const double share : {0.0, 0.5, 0.99, 1.0})
    EXPECT_EQ(histogram.quantile_ns(share), 123'456'789);
}

TEST(Histogram, SmallValuesAreExact) {
  Histogram histogram;
  for (int value = 0; value < 256; ++value)
    histogram.record(value);
  EXPECT_EQ(histogram.quantile_ns(0.5), 127);
  EXPECT_EQ(histogram.quantile_ns(0.25), 63);
  EXPECT_EQ(histogram.filled_buckets().size(), 256U);
}

TEST(Histogram, QuantilesAreWithinOnePercentOfTheExactOnes) {
  std::mt19937_64 random(7);
  std::lognormal_distribution<double> distribution(10.0, 3.0);
  Histogram histogram;
  std::vector<std::int64_t> values;
  for (int i = 0; i < 100'000; ++i) {
    const auto value = static_cast<std::int64_t>(distribution(random));
    values.push_back(value);
    histogram.record(value);
  }
  std::sort(values.begin(), values.end());
  for (const double share : {0.001, 0.1, 0.5, 0.9, 0.99, 0.999}) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(values.size()))) - 1;
    const auto exact = static_cast<double>(values[rank]);
    EXPECT_NEAR(static_cast<double>(histogram.quantile_ns(share)), exact, 0.004 * exact + 0.5) << share;
  }
  EXPECT_EQ(histogram.max_ns(), values.back());
  EXPECT_EQ(histogram.quantile_ns(1.0), values.back());
  EXPECT_EQ(histogram.min_ns(), values.front());
}

TEST(Histogram, BucketsCoverEveryValueOnceAndAreNarrow) {
  std::mt19937_64 random(11);
  Histogram histogram;
  std::uniform_int_distribution<int> bits(0, 41);
  for (int i = 0; i < 20'000; ++i) {
    const int shift = bits(random);
    const auto value = static_cast<std::int64_t>(random() & ((std::uint64_t{2} << shift) - 1));
    Histogram one;
    one.record(value);
    const auto filled = one.filled_buckets();
    ASSERT_EQ(filled.size(), 1U);
    EXPECT_LE(filled[0].first_ns, value);
    EXPECT_GE(filled[0].last_ns, value);
    EXPECT_LE((filled[0].last_ns - filled[0].first_ns) * 127, std::max<std::int64_t>(filled[0].first_ns, 1));
    if (i < 2000) histogram.record(value);
  }
  std::int64_t past = -1;
  std::uint64_t sum = 0;
  for (const auto& bucket : histogram.filled_buckets()) {
    EXPECT_GT(bucket.first_ns, past) << "buckets overlap";
    past = bucket.last_ns;
    sum += bucket.count;
  }
  EXPECT_EQ(sum, 2000U);
}

TEST(Histogram, ValuesOutOfRangeAreCountedInTheOuterBuckets) {
  Histogram histogram;
  histogram.record(-5);
  histogram.record(std::int64_t{1} << 50);
  EXPECT_EQ(histogram.min_ns(), 0);
  EXPECT_EQ(histogram.max_ns(), std::int64_t{1} << 50);
  EXPECT_EQ(histogram.count(), 2U);
  EXPECT_EQ(histogram.filled_buckets().back().last_ns, (std::int64_t{1} << 42) - 1);
}

}  // namespace
}  // namespace hil::executive
