#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>

namespace hil::config {
namespace {

TEST(ReadNumber, AcceptsDecimalForms) {
  const std::pair<const char*, double> good[] = {{"0", 0.0},
                                                 {"-0", -0.0},
                                                 {"10", 10.0},
                                                 {"+5", 5.0},
                                                 {"-2.5", -2.5},
                                                 {".5", 0.5},
                                                 {"5.", 5.0},
                                                 {"1e3", 1000.0},
                                                 {"1.5E-3", 0.0015},
                                                 {"0.1", 0.1},
                                                 {"1e308", 1e308},
                                                 {"4.9e-324", 4.9e-324},
                                                 {"0e999999999999", 0.0}};
  for (const auto& [text, value] : good) {
    const ParsedNumber reading = read_number(text);
    EXPECT_EQ(reading.fault, "") << text;
    EXPECT_EQ(reading.length, std::string(text).size()) << text;
    EXPECT_EQ(reading.value, value) << text;
  }
}

TEST(ReadNumber, RefusesOtherTextsWithTheReason) {
  const std::pair<const char*, std::vector<const char*>> bad[] = {
      {"not a number", {"", "abc", ".", "-"}},
      {"finite", {"nan", ".nan", "-.inf", "Infinity"}},
      {"leading zero", {"010", "-007"}},
      {"too large", {"1e400", "-1e400", "1e99999999999999999999"}},
      {"too close to zero", {"1e-400", "0.0001e-400"}}};
  for (const auto& [why, texts] : bad) {
    for (const char* text : texts)
      EXPECT_NE(read_number(text).fault.find(why), std::string::npos) << text;
  }
}

TEST(ReadNumber, StopsWhereTheNumberEnds) {
  EXPECT_EQ(read_number("50 km/h").length, 2U);
  EXPECT_EQ(read_number("5e").length, 1U);  // an e without digits belongs to what follows
  EXPECT_EQ(read_number("5e+m").length, 1U);
  EXPECT_EQ(read_number("1,5").length, 1U);
  EXPECT_EQ(read_number("1_000").length, 1U);
}

TEST(ReadNumber, AgreesWithStrtodOnRandomDoubles) {
  std::mt19937_64 random(11);
  int checked = 0;
  for (int i = 0; i < 20'000; ++i) {
    const auto value = std::bit_cast<double>(random());
    if (!std::isfinite(value)) continue;
    char text[40];
    std::snprintf(text, sizeof text, "%.17g", value);
    const ParsedNumber reading = read_number(text);
    ASSERT_EQ(reading.fault, "") << text;
    ASSERT_EQ(reading.value, std::strtod(text, nullptr)) << text;
    ASSERT_EQ(reading.value, value) << text;
    ++checked;
  }
  EXPECT_GT(checked, 19'000);
}

TEST(ReadInteger, AcceptsDecimalAndHexadecimal) {
  const std::pair<const char*, std::int64_t> good[] = {
      {"0", 0},
      {"-0", 0},
      {"42", 42},
      {"+42", 42},
      {"0x1F", 31},
      {"-0x10", -16},
      {"0x00ff", 255},
      {"9223372036854775807", std::numeric_limits<std::int64_t>::max()},
      {"-9223372036854775808", std::numeric_limits<std::int64_t>::min()}};
  for (const auto& [text, value] : good) {
    EXPECT_EQ(read_integer(text).fault, "") << text;
    EXPECT_EQ(read_integer(text).value, value) << text;
  }
}

TEST(ReadInteger, RefusesOtherTextsWithTheReason) {
  const std::pair<const char*, std::vector<const char*>> bad[] = {
      {"whole number", {"", "1.0", "1e3", "0x", "--1", "+-1", "0o17", "1_000", "1:30", "0x-5", "12 "}},
      {"leading zero", {"010"}},
      {"64 bits", {"9223372036854775808", "-9223372036854775809", "0xFFFFFFFFFFFFFFFF"}}};
  for (const auto& [why, texts] : bad) {
    for (const char* text : texts)
      EXPECT_NE(read_integer(text).fault.find(why), std::string::npos) << text;
  }
}

TEST(MultiplyExactly, IsExactWhereDoublesAreNot) {
  EXPECT_EQ(multiply_exactly("1", 1'000'000), 1'000'000);
  EXPECT_EQ(multiply_exactly("0.1", 1'000'000'000), 100'000'000);
  EXPECT_EQ(multiply_exactly("0.123456789", 1'000'000'000), 123'456'789);
  EXPECT_EQ(multiply_exactly("9007199254740993", 1), 9'007'199'254'740'993);  // 2^53 + 1
  EXPECT_EQ(multiply_exactly("2.5", 1), 3);
  EXPECT_EQ(multiply_exactly("-2.5", 1), -3);
  EXPECT_EQ(multiply_exactly("2.4999999", 1), 2);
  EXPECT_EQ(multiply_exactly("0.5", 1), 1);
  EXPECT_EQ(multiply_exactly("0.49", 1), 0);
  EXPECT_EQ(multiply_exactly("1e-99", 1'000'000'000), 0);
  EXPECT_EQ(multiply_exactly("1.5e3", 1'000), 1'500'000);
  EXPECT_EQ(multiply_exactly("000", 5), 0);
  EXPECT_EQ(multiply_exactly("9223372036.85477580", 1'000'000'000), 9'223'372'036'854'775'800);
  EXPECT_EQ(multiply_exactly("9223372037", 1'000'000'000), std::nullopt);
  EXPECT_EQ(multiply_exactly("1e999999999", 1), std::nullopt);
  EXPECT_EQ(multiply_exactly("x", 1), std::nullopt);
  EXPECT_EQ(multiply_exactly("", 1), std::nullopt);
}

TEST(MultiplyExactly, GivesRandomNanosecondsExactly) {
  std::mt19937_64 random(12);
  for (int i = 0; i < 20'000; ++i) {
    const auto nanoseconds = static_cast<std::int64_t>(random() % 1'000'000'000'000'000'000ULL);
    std::string fraction = std::to_string(nanoseconds % 1'000'000'000);
    fraction.insert(0, 9 - fraction.size(), '0');
    const std::string seconds = std::to_string(nanoseconds / 1'000'000'000) + "." + fraction;
    ASSERT_EQ(multiply_exactly(seconds, 1'000'000'000), nanoseconds) << seconds;
  }
}

TEST(Units, ConvertToSi) {
  constexpr double pi = std::numbers::pi;
  const std::tuple<const char*, Quantity, double> good[] = {
      {"2 m", Quantity::length_m, 2.0},
      {"2cm", Quantity::length_m, 0.02},
      {"3 mm", Quantity::length_m, 0.003},
      {"1.5 km", Quantity::length_m, 1500.0},
      {"50 km/h", Quantity::speed_mps, 50.0 / 3.6},
      {"-14 m/s", Quantity::speed_mps, -14.0},
      {"9 m/s2", Quantity::acceleration_mps2, 9.0},
      {"9 m/s^2", Quantity::acceleration_mps2, 9.0},
      {"0.3 g", Quantity::acceleration_mps2, 0.3 * 9.80665},
      {"140 deg", Quantity::angle_rad, 140.0 * pi / 180.0},
      {"1 rad", Quantity::angle_rad, 1.0},
      {"5 mrad", Quantity::angle_rad, 0.005},
      {"90 deg/s", Quantity::angular_rate_radps, pi / 2},
      {"60 rpm", Quantity::angular_rate_radps, 2 * pi},
      {"2 rad/s", Quantity::angular_rate_radps, 2.0},
      {"1 kHz", Quantity::frequency_hz, 1000.0},
      {"2 MHz", Quantity::frequency_hz, 2e6},
      {"20 Hz", Quantity::frequency_hz, 20.0},
      {"1.2 t", Quantity::mass_kg, 1200.0},
      {"300 g", Quantity::mass_kg, 0.3},
      {"70 kg", Quantity::mass_kg, 70.0},
      {"1.5 kN", Quantity::force_n, 1500.0},
      {"20 mN m", Quantity::torque_nm, 0.02},
      {"3 kN m", Quantity::torque_nm, 3000.0},
      {"2.5 t m2", Quantity::inertia_kgm2, 2500.0},
      {"4 kg m^2", Quantity::inertia_kgm2, 4.0},
      {"20 kN/m", Quantity::stiffness_npm, 20e3},
      {"0.5 MN/m", Quantity::stiffness_npm, 5e5},
      {"3 N s/m", Quantity::damping_nspm, 3.0},
      {"3 kN s/m", Quantity::damping_nspm, 3e3},
      {"2 klx", Quantity::illuminance_lx, 2000.0},
      {"5 lx", Quantity::illuminance_lx, 5.0},
      {"3 kcd", Quantity::luminous_intensity_cd, 3000.0},
      {"7 cd/m2", Quantity::luminance_cdpm2, 7.0},
      {"7 cd/m^2", Quantity::luminance_cdpm2, 7.0},
      {"1 kcd/m2", Quantity::luminance_cdpm2, 1000.0},
      {"1 ms", Quantity::duration_s, 0.001},
      {"2 min", Quantity::duration_s, 120.0},
      {"  7   us  ", Quantity::duration_s, 7e-6},
  };
  for (const auto& [text, quantity, si] : good) {
    const QuantityReading reading = read_quantity(text, quantity);
    EXPECT_EQ(reading.fault, "") << text;
    EXPECT_DOUBLE_EQ(reading.value_si, si) << text;
  }
}

TEST(Units, DurationsAreExactToTheNanosecond) {
  const std::pair<const char*, std::int64_t> good[] = {{"1 ms", 1'000'000},
                                                       {"0.1 ms", 100'000},
                                                       {"1 ns", 1},
                                                       {"0.4 ns", 0},
                                                       {"0.5 ns", 1},
                                                       {"10 s", 10'000'000'000},
                                                       {"1 min", 60'000'000'000},
                                                       {"33.333333 ms", 33'333'333},
                                                       {"-2 us", -2'000}};
  for (const auto& [text, nanoseconds] : good) {
    EXPECT_EQ(read_quantity(text, Quantity::duration_s).nanoseconds, nanoseconds) << text;
  }
  EXPECT_EQ(read_quantity("1 ms", Quantity::duration_s).value_si, 0.001);  // the nearest double, not near it
  EXPECT_NE(read_quantity("300e9 s", Quantity::duration_s).fault.find("292 years"), std::string::npos);
}

TEST(Units, AreReadBackAsFormatted) {
  int units = 0;
  for (const Quantity quantity :
       {Quantity::length_m, Quantity::speed_mps, Quantity::acceleration_mps2, Quantity::angle_rad,
        Quantity::angular_rate_radps, Quantity::duration_s, Quantity::frequency_hz, Quantity::mass_kg,
        Quantity::force_n, Quantity::torque_nm, Quantity::inertia_kgm2}) {
    for (const Unit& unit : units_of(quantity)) {
      const std::string text = "7 " + std::string(unit.symbol);
      const QuantityReading reading = read_quantity(text, quantity);
      ASSERT_EQ(reading.fault, "") << text;
      EXPECT_EQ(format_quantity(reading.value_si, unit), text);
      ++units;
    }
  }
  EXPECT_EQ(units, 35);
}

TEST(Units, AreRefusedWithTheAllowedOnes) {
  const std::tuple<const char*, Quantity, const char*> bad[] = {
      {"50 kg", Quantity::speed_mps, "has the unit 'kg', but a speed is written in m/s, km/h"},
      {"50", Quantity::speed_mps, "has no unit; a speed is written in m/s, km/h"},
      {"0", Quantity::length_m, "has no unit"},
      {"fast", Quantity::speed_mps, "is not a number with a unit"},
      {"1 Ms", Quantity::duration_s, "did you mean 'ms'?"},
      {"1 khz", Quantity::frequency_hz, "did you mean 'kHz'?"},
      {"1,5 m", Quantity::length_m, "has the unit ',5 m'"},
      {"1e308 km", Quantity::length_m, "too large"},
      {"inf m", Quantity::length_m, "is not a number"},
      {"010 m", Quantity::length_m, "leading zero"},
  };
  for (const auto& [text, quantity, why] : bad) {
    const QuantityReading reading = read_quantity(text, quantity);
    EXPECT_NE(reading.fault.find(why), std::string::npos) << text << ": " << reading.fault;
  }
}

}  // namespace
}  // namespace hil::config
