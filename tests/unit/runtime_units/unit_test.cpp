// Units of signals and expressions.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include <hil/quantity.hpp>
#include <hil/unit.hpp>

namespace hil::units {
namespace {

double si(const std::string& unit, double value) {
  const auto parsed = parse_unit(unit);
  EXPECT_TRUE(parsed) << unit;
  return parsed ? parsed->to_si(value) : std::nan("");
}

std::string dimension(const std::string& unit) {
  const auto parsed = parse_unit(unit);
  return parsed ? si_symbol(parsed->dimension) : "none";
}

TEST(Unit, HasItsDimensionHoweverItIsWritten) {
  for (const char* unit :
       {"m/s2", "m/s^2", "m s-2", "m.s-2", "m*s^-2", "m/s/s", "m/s\u00b2", "m\u00b7s\u207b\u00b2"})
    EXPECT_EQ(dimension(unit), "m/s2") << unit;
  for (const char* unit : {"N m", "Nm", "N.m", "N\u00b7m", "kNm", "mNm", "J", "W s"})
    EXPECT_EQ(dimension(unit), "kg m2/s2") << unit;
  for (const char* unit : {"", "-", "1", "rad", "deg", "\u00b0", "%", "ppm", " % "})
    EXPECT_EQ(dimension(unit), "1") << unit;
  for (const char* unit : {"1/min", "rpm", "U/min", "Hz", "rad/s", "rev/min"})
    EXPECT_EQ(dimension(unit), "1/s") << unit;
  EXPECT_EQ(dimension("degC"), "K");
  EXPECT_EQ(dimension("V"), "kg m2/A s3");
  EXPECT_EQ(dimension("W/m2 K"), "kg/K s3") << "all symbols after a stroke are below it";
}

TEST(Unit, ValuesInTheSi) {
  EXPECT_EQ(si("km/h", 36.0), 10.0);
  EXPECT_EQ(si("mm", 1234.0), 1.234);
  EXPECT_EQ(si("g", 500.0), 0.5);
  EXPECT_EQ(si("t", 2.0), 2000.0);
  EXPECT_EQ(si("kN", 3.0), 3000.0);
  EXPECT_EQ(si("bar", 1.5), 1.5e5);
  EXPECT_EQ(si("kWh", 1.0), 3.6e6);
  EXPECT_EQ(si("l/min", 60.0), 1e-3);
  EXPECT_EQ(si("cm2", 1.0), 1e-4);
  EXPECT_EQ(si("min", 2.0), 120.0) << "not a milli-inch";
  EXPECT_EQ(si("%", 50.0), 0.5);
  EXPECT_DOUBLE_EQ(si("deg", 180.0), std::numbers::pi);
  EXPECT_DOUBLE_EQ(si("rpm", 60.0), 2.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(si("rev/min", 60.0), si("rpm", 60.0));
  EXPECT_DOUBLE_EQ(si("1/min", 60.0), 1.0);
  EXPECT_DOUBLE_EQ(si("\u00b5V", 1.0), 1e-6);
  EXPECT_DOUBLE_EQ(si("k\u03a9", 1.0), 1e3);
  EXPECT_DOUBLE_EQ(si("kohm", 1.0), si("kOhm", 1.0));
  EXPECT_DOUBLE_EQ(si("gn", 1.0), 9.80665);
}

TEST(Unit, TemperaturesHaveAnOffsetWhereTheyStandAlone) {
  for (const char* unit : {"degC", "\u00b0C", "deg C", "Celsius"})
    EXPECT_DOUBLE_EQ(si(unit, 20.0), 293.15) << unit;
  EXPECT_NEAR(si("degF", 212.0), 373.15, 1e-9);
  EXPECT_DOUBLE_EQ(si("degC/s", 20.0), 20.0);
  EXPECT_DOUBLE_EQ(parse_unit("degC")->difference_to_si().of(20.0), 20.0);
}

TEST(Unit, DifferencesOfTemperaturesAreInKelvin) {
  EXPECT_EQ(difference_unit("degC").symbol, "K");
  EXPECT_EQ(difference_unit("degC").factor, 1.0);
  EXPECT_NEAR(difference_unit("degF").factor, 1.8, 1e-12);
  EXPECT_EQ(difference_unit("km/h").symbol, "km/h");
  EXPECT_EQ(difference_unit("steps").symbol, "steps") << "also where it is no unit";
  EXPECT_EQ(difference_unit("steps").factor, 1.0);
}

TEST(Unit, OtherTextsAreNone) {
  for (const char* unit : {"steps",   "m//s",  "m/",   "/s",      "m^",
                           "m-",      "m2-",   "m-s",  "2 m",     "m+s",
                           "km/hour", "xm",    "m101", "mm^-101", "m 1 x",
                           "kkm",     "gauge", "\xb0", "0m",      "1/0 m",
                           "100",     "1/100", "m 2",  "10.m",    "1234567890123456m"})
    EXPECT_FALSE(parse_unit(unit)) << unit;
}

TEST(Unit, ConvertsIntoUnitsOfItsDimension) {
  const auto of = [](const char* from, const char* to, double value) {
    const auto found = conversion(*parse_unit(from), *parse_unit(to));
    return found ? found->of(value) : std::nan("");
  };
  EXPECT_EQ(of("km/h", "m/s", 36.0), 10.0);
  EXPECT_EQ(of("m/s", "km/h", 10.0), 36.0);
  EXPECT_EQ(of("%", "1", 5.0), 0.05);
  EXPECT_DOUBLE_EQ(of("degC", "degF", 100.0), 212.0);
  EXPECT_NEAR(of("K", "degC", 300.0), 26.85, 1e-12);
  EXPECT_TRUE(std::isnan(of("km/h", "m", 1.0)));
  EXPECT_TRUE(conversion(*parse_unit("N m"), *parse_unit("J"))->is_identity());
  EXPECT_FALSE(conversion(*parse_unit("mm"), *parse_unit("m"))->is_identity());
  const auto there = *conversion(*parse_unit("degF"), *parse_unit("K"));
  const auto back = *conversion(*parse_unit("K"), *parse_unit("degF"));
  EXPECT_NEAR(back.of(there.of(70.0)), 70.0, 1e-10);
}

TEST(Unit, ANumberBeforeASymbolIsAFactor) {
  EXPECT_DOUBLE_EQ(si("l/100km", 8.0), 8e-8);
  EXPECT_DOUBLE_EQ(si("l/100 km", 8.0), 8e-8);
  EXPECT_DOUBLE_EQ(si("kWh/100km", 15.0), 15.0 * 3.6e6 / 1e5);
  EXPECT_DOUBLE_EQ(si("10mV", 420.0), 4.2);
  EXPECT_DOUBLE_EQ(si("100ms", 20.0), 2.0);
  EXPECT_DOUBLE_EQ(si("0.25deg", 720.0), std::numbers::pi);
  EXPECT_DOUBLE_EQ(si("100km2", 1.0), 1e8) << "the exponent is that of the symbol";
  EXPECT_DOUBLE_EQ(si("0.1degC", 200.0), 293.15) << "tenths of degrees on the scale";
  EXPECT_DOUBLE_EQ(si("1/100km", 1.0), 1e-5);
  EXPECT_EQ(si("1/s", 3.0), 3.0);
}

double converted(const std::string& from, const std::string& to, double value) {
  const auto found = conversion(*parse_unit(from), *parse_unit(to));
  return found ? found->of(value) : std::nan("");
}

TEST(Unit, TurnsConvertIntoRadiansAndIntoCycles) {
  EXPECT_EQ(converted("rpm", "1/min", 3000.0), 3000.0);
  EXPECT_EQ(converted("1/min", "rpm", 3000.0), 3000.0);
  EXPECT_EQ(converted("rpm", "Hz", 600.0), 10.0);
  EXPECT_EQ(converted("rev/s", "1/s", 7.0), 7.0);
  EXPECT_EQ(converted("U/min", "RPM", 600.0), 600.0);
  EXPECT_DOUBLE_EQ(converted("rpm", "rad/s", 60.0), 2.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(converted("deg/s", "rpm", 6.0), 1.0);
  EXPECT_DOUBLE_EQ(converted("rev/min", "deg/s", 1.0), 6.0);
  EXPECT_EQ(converted("rpm/s", "Hz/s", 60.0), 1.0);
  EXPECT_DOUBLE_EQ(converted("rpm/s", "rad/s2", 60.0), 2.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(converted("rev", "rad", 1.0), 2.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(converted("N m/rad", "N m/rev", 1.0), 2.0 * std::numbers::pi);
}

TEST(Unit, RadiansAreNoCycles) {
  for (const char* radians : {"rad/s", "deg/s", "mrad/s", "rad/min"}) {
    for (const char* cycles : {"Hz", "kHz", "1/s", "1/min", "1/h", "s-1"}) {
      EXPECT_TRUE(std::isnan(converted(radians, cycles, 1.0))) << radians << " " << cycles;
      EXPECT_TRUE(std::isnan(converted(cycles, radians, 1.0))) << radians << " " << cycles;
    }
  }
  EXPECT_TRUE(std::isnan(converted("rad/s2", "Hz/s", 1.0)));
  EXPECT_EQ(converted("N m rad/s", "W", 5.0), 5.0) << "elsewhere rad is 1";
  EXPECT_EQ(converted("rad m/s2", "m/s2", 5.0), 5.0);
  EXPECT_TRUE(std::isnan(converted("N m rpm", "W", 5.0))) << "a turn may be 1 or 2 pi";
  EXPECT_TRUE(std::isnan(converted("l/rev", "l", 5.0)));
}

TEST(Unit, AnglesHaveNoPrefixAboveOneAndGradIsADegree) {
  for (const char* unit : {"Trad", "Mrad", "krad", "hrad", "darad", "krad/s", "N m/Mrad"})
    EXPECT_FALSE(parse_unit(unit)) << unit;
  for (const auto& [unit, radians] :
       {std::pair{"mrad", 1e-3}, {"urad", 1e-6}, {"crad", 1e-2}, {"nrad", 1e-9}})
    EXPECT_DOUBLE_EQ(converted(unit, "rad", 1.0), radians) << unit;
  EXPECT_DOUBLE_EQ(converted("Grad", "deg", 90.0), 90.0);
  EXPECT_DOUBLE_EQ(converted("Grad/s", "rpm", 6.0), 1.0);
  EXPECT_DOUBLE_EQ(converted("GHz", "Hz", 1.0), 1e9) << "other symbols have all prefixes";
}

TEST(Unit, ANumberOfCyclesIsNoAngle) {
  for (const char* angle : {"rad", "deg", "rev", "mrad", "Grad"}) {
    EXPECT_FALSE(signal_conversion("", angle, ValueKind::open)) << angle;
    const Unit unit = *parse_unit(angle);
    const Angle cycles = angle_of(*parse_unit(""), ValueKind::open);
    EXPECT_NE(angle_hint(unit.dimension, cycles, unit.angle).find("1 rev"), std::string::npos) << angle;
  }
  EXPECT_EQ(signal_conversion("", "%", ValueKind::open)->of(1.0), 100.0);
  EXPECT_TRUE(signal_conversion("", "1", ValueKind::open)->is_identity());
  EXPECT_TRUE(signal_conversion("", "rad")->is_identity()) << "a plain number is in the SI";
}

/// Each pair of random products of rates, by the rule of the guide.
TEST(Unit, RandomRatesConvertByTheirKind) {
  struct Rate {
    const char* text;
    char kind;
    double si;  ///< turns and cycles: per second; radians: per second
  };
  const Rate rates[] = {{"rpm", 't', 1.0 / 60.0},
                        {"rev/s", 't', 1.0},
                        {"rev/min", 't', 1.0 / 60.0},
                        {"rad/s", 'r', 1.0},
                        {"deg/s", 'r', std::numbers::pi / 180.0},
                        {"Hz", 'c', 1.0},
                        {"1/min", 'c', 1.0 / 60.0},
                        {"kHz", 'c', 1000.0},
                        {"2rev/s", 't', 2.0},
                        {"10deg/s", 'r', std::numbers::pi / 18.0},
                        {"1/100ms", 'c', 10.0}};
  const double turn = 2.0 * std::numbers::pi;
  for (const Rate& from : rates) {
    for (const Rate& to : rates) {
      const double found = converted(from.text, to.text, 12.0);
      const bool is_refused = (from.kind == 'r' && to.kind == 'c') || (from.kind == 'c' && to.kind == 'r');
      EXPECT_EQ(std::isnan(found), is_refused) << from.text << " " << to.text;
      if (is_refused) continue;
      const double factor = from.kind == 't' && to.kind == 'r'   ? turn
                            : from.kind == 'r' && to.kind == 't' ? 1.0 / turn
                                                                 : 1.0;
      EXPECT_NEAR(found / (12.0 * from.si * factor / to.si), 1.0, 1e-12) << from.text << " " << to.text;
    }
  }
}

TEST(Unit, WithoutAUnitASignalIsInTheSi) {
  EXPECT_EQ(signal_conversion("", "%")->of(1.0), 100.0);
  EXPECT_EQ(signal_conversion("%", "")->of(50.0), 0.5);
  EXPECT_EQ(signal_conversion("", "km/h")->of(10.0), 36.0);
  EXPECT_EQ(signal_conversion("km/h", "")->of(36.0), 10.0);
  EXPECT_DOUBLE_EQ(signal_conversion("deg", "")->of(180.0), std::numbers::pi);
  EXPECT_TRUE(signal_conversion("", "m")->is_identity());
  EXPECT_TRUE(signal_conversion("steps", "")->is_identity());
  EXPECT_TRUE(signal_conversion("steps", "steps")->is_identity());
  EXPECT_FALSE(signal_conversion("steps", "m"));
  EXPECT_FALSE(signal_conversion("", "rpm")) << "1 may be a turn or a radian per second";
}

/// The units of parameters are units of signals too, with the same factor and one dimension for a quantity.
/// As an acceleration, g is the one of gravity, which signals call gn.
TEST(Unit, UnitsOfParametersAreUnits) {
  for (int quantity = 0; quantity <= static_cast<int>(config::Quantity::share); ++quantity) {
    const auto units = config::units_of(static_cast<config::Quantity>(quantity));
    const std::string first = quantity == static_cast<int>(config::Quantity::share)
                                  ? "1"
                                  : dimension(std::string(units.front().symbol));
    for (const config::Unit& unit : units) {
      const bool is_gravity = unit.symbol == "g" && unit.numerator != 1.0;
      const std::string symbol = is_gravity ? "gn" : std::string(unit.symbol);
      EXPECT_EQ(dimension(symbol), first) << symbol;
      EXPECT_DOUBLE_EQ(si(symbol, 1.0), unit.numerator / unit.denominator) << symbol;
    }
  }
}

TEST(Dimension, ProductsAndRoots) {
  const Dimension speed = parse_unit("m/s")->dimension;
  EXPECT_EQ(si_symbol(*product(speed, speed)), "m2/s2");
  EXPECT_EQ(square_root(*product(speed, speed)), speed);
  EXPECT_FALSE(square_root(speed));
  EXPECT_EQ(si_symbol(*power(speed, -2)), "s2/m2");
  EXPECT_FALSE(power(speed, 101));
}

}  // namespace
}  // namespace hil::units
