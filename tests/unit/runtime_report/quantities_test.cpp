#include "runtime/report/quantities.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace hil::report {
namespace {

constexpr std::int64_t smallest = std::numeric_limits<std::int64_t>::min();
constexpr std::int64_t largest = std::numeric_limits<std::int64_t>::max();

TEST(MeasuredTime, HasThreeDigitsAndASuitableUnit) {
  EXPECT_EQ(measured_time(0), "0");
  EXPECT_EQ(measured_time(1), "1 ns");
  EXPECT_EQ(measured_time(999), "999 ns");
  EXPECT_EQ(measured_time(1'000), "1.00 µs");
  EXPECT_EQ(measured_time(1'234), "1.23 µs");
  EXPECT_EQ(measured_time(12'345), "12.3 µs");
  EXPECT_EQ(measured_time(412'345), "412 µs");
  EXPECT_EQ(measured_time(8'000'000), "8.00 ms");
  EXPECT_EQ(measured_time(10'021'000'000), "10.0 s");
  EXPECT_EQ(measured_time(4'000'000'000'000), "4\u202F000 s");
}

TEST(MeasuredTime, RoundsToTheNextUnit) {
  EXPECT_EQ(measured_time(9'994), "9.99 µs");
  EXPECT_EQ(measured_time(9'995), "10.0 µs");
  EXPECT_EQ(measured_time(99'950), "100 µs");
  EXPECT_EQ(measured_time(999'499), "999 µs");
  EXPECT_EQ(measured_time(999'500), "1.00 ms");
  EXPECT_EQ(measured_time(999'999'999), "1.00 s");
}

TEST(MeasuredTime, HasASignAndALargeRange) {
  EXPECT_EQ(measured_time(-402'113), "\u2212402 µs");
  EXPECT_EQ(measured_time(smallest), "\u22129\u202F223\u202F372\u202F037 s");
  EXPECT_EQ(measured_time(largest), "9\u202F223\u202F372\u202F037 s");
}

TEST(ChosenTime, HasAllDigits) {
  EXPECT_EQ(chosen_time(0), "0");
  EXPECT_EQ(chosen_time(8'000'000), "8 ms");
  EXPECT_EQ(chosen_time(1'500'000), "1.5 ms");
  EXPECT_EQ(chosen_time(12'345'678), "12.345678 ms");
  EXPECT_EQ(chosen_time(1'000'000'001), "1.000000001 s");
  EXPECT_EQ(chosen_time(250), "250 ns");
  EXPECT_EQ(chosen_time(-20'000'000), "\u221220 ms");
  EXPECT_EQ(chosen_time(smallest), "\u22129\u202F223\u202F372\u202F036.854775808 s");
}

TEST(Instant, IsInSecondsWithMilliseconds) {
  EXPECT_EQ(instant(0), "0.000 s");
  EXPECT_EQ(instant(8'412'999'999), "8.412 s");
  EXPECT_EQ(instant(-1'500'000'000), "\u22121.500 s");
  EXPECT_EQ(instant(-5), "0.000 s");
}

TEST(CountText, GroupsThousands) {
  EXPECT_EQ(count_text(0), "0");
  EXPECT_EQ(count_text(999), "999");
  EXPECT_EQ(count_text(1'000), "1\u202F000");
  EXPECT_EQ(count_text(12'345'678), "12\u202F345\u202F678");
  EXPECT_EQ(counted(1, "miss", "misses"), "1 miss");
  EXPECT_EQ(counted(0, "miss", "misses"), "0 misses");
}

TEST(Numbers, AreShortAndNeverNan) {
  EXPECT_EQ(rate_text(1000.0), "1 kHz");
  EXPECT_EQ(rate_text(2.5), "2.5 Hz");
  EXPECT_EQ(percent(0.1249), "12.5 %");
  EXPECT_EQ(percent(1.3, 0), "130 %");
  EXPECT_EQ(decimal(-0.0004, 3), "0.000") << "no negative zero";
  EXPECT_EQ(decimal(-1.25, 1), "\u22121.2");
  EXPECT_EQ(decimal(1e300, 2).size(), 304U);
  EXPECT_EQ(shortest(0.1), "0.1");
  for (const double odd : {std::nan(""), HUGE_VAL, -HUGE_VAL}) {
    EXPECT_EQ(decimal(odd, 2), dash);
    EXPECT_EQ(shortest(odd), dash);
    EXPECT_EQ(percent(odd), dash);
    EXPECT_EQ(rate_text(odd), dash);
  }
}

TEST(BytesText, HasThreeDigits) {
  EXPECT_EQ(bytes_text(0), "0 B");
  EXPECT_EQ(bytes_text(999), "999 B");
  EXPECT_EQ(bytes_text(1'000), "1.00 kB");
  EXPECT_EQ(bytes_text(9'995), "10.0 kB");
  EXPECT_EQ(bytes_text(99'950), "100 kB");
  EXPECT_EQ(bytes_text(999'499), "999 kB");
  EXPECT_EQ(bytes_text(999'500), "1.00 MB");
  EXPECT_EQ(bytes_text(16'777'216), "16.8 MB");
  EXPECT_EQ(bytes_text(~std::uint64_t{0}), "18.4 EB");
}

TEST(ToAscii, ReplacesEverySpecialCharacter) {
  EXPECT_EQ(to_ascii(measured_time(-402'113)), "-402 us");
  EXPECT_EQ(to_ascii(count_text(12'345'678)), "12345678");
  EXPECT_EQ(to_ascii(dash), "-");
}

}  // namespace
}  // namespace hil::report
