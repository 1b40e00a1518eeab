// How a signal's values are converted for its readers.

#include "runtime/signals/known_signals.hpp"

#include <gtest/gtest.h>

namespace hil::signals {
namespace {

class KnownSignalsTest : public ::testing::Test {
 protected:
  units::Conversion conversion(const std::string& unit, const std::string& unit_of_reader,
                               units::ValueKind value_kind = units::ValueKind::as_unit) {
    const SignalId signal = table_.add({.name = "s" + std::to_string(table_.size()),
                                        .unit = unit,
                                        .writer = "test",
                                        .value_kind = value_kind});
    return known_.conversion_for(signal, "reader", unit_of_reader, {}, diagnostics_);
  }

  SignalTable table_;
  KnownSignals known_{table_};
  config::Diagnostics diagnostics_;
};

TEST_F(KnownSignalsTest, UnitsOfOneKindAreConverted) {
  EXPECT_EQ(conversion("km/h", "m/s").of(36.0), 10.0);
  EXPECT_EQ(conversion("%", "1").of(50.0), 0.5);
  EXPECT_DOUBLE_EQ(conversion("degC", "K").of(20.0), 293.15);
  EXPECT_TRUE(conversion("m/s^2", "m/s2").is_identity());
  EXPECT_TRUE(diagnostics_.empty()) << diagnostics_.to_text();
}

TEST_F(KnownSignalsTest, WithoutAUnitValuesAreInTheSi) {
  EXPECT_TRUE(conversion("", "m/s").is_identity());
  EXPECT_TRUE(conversion("m/s", "").is_identity());
  EXPECT_TRUE(conversion("steps", "steps").is_identity());
  EXPECT_EQ(diagnostics_.to_text(), "");
  EXPECT_EQ(conversion("", "%").of(0.5), 50.0);
  EXPECT_EQ(conversion("km/h", "").of(36.0), 10.0);
  const std::string text = diagnostics_.to_text();
  EXPECT_NE(text.find("'s3' has no unit, so it is in the SI, and 1 is 100 %"), std::string::npos) << text;
  EXPECT_NE(text.find("'reader' has no unit, so it is in the SI, and 1 is 3.6 km/h"), std::string::npos)
      << text;
  EXPECT_TRUE(known_.conversion_for({}, "reader", "m", {}, diagnostics_).is_identity());
  EXPECT_TRUE(diagnostics_.empty()) << diagnostics_.to_text();
}

TEST_F(KnownSignalsTest, DifferencesAndOpenRatesConvertByTheirKind) {
  EXPECT_TRUE(conversion("1/s", "rad/s", units::ValueKind::open).is_identity());
  EXPECT_TRUE(conversion("1/s", "Hz", units::ValueKind::open).is_identity());
  EXPECT_TRUE(conversion("K", "K", units::ValueKind::difference).is_identity());
  EXPECT_EQ(diagnostics_.to_text(), "");
  conversion("1/s", "rpm", units::ValueKind::open);
  conversion("K", "degC", units::ValueKind::difference);
  const std::string text = diagnostics_.to_text();
  EXPECT_NE(text.find("'s3' is in 1/s, but 'reader' is in rpm; the computed rate may count radians or turns"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("'s4' is in K, but 'reader' is in degC; it is a difference of temperatures"),
            std::string::npos)
      << text;
}

TEST_F(KnownSignalsTest, OtherUnitsAreMistakes) {
  conversion("m", "m/s");
  conversion("steps", "m");
  conversion("m", "Unit_Metre");
  conversion("rad/s", "Hz");
  conversion("", "rpm");
  const std::string text = diagnostics_.to_text();
  EXPECT_NE(text.find("'s0' is in m, but 'reader' is in m/s\n"), std::string::npos) << text;
  EXPECT_NE(text.find("'s1' is in steps, but 'reader' is in m; 'steps' is not a known unit"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("'s2' is in m, but 'reader' is in Unit_Metre; 'Unit_Metre' is not a known unit"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("'s3' is in rad/s, but 'reader' is in Hz; an angular rate is no frequency"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("'s4' is in no unit, but 'reader' is in rpm"), std::string::npos) << text;
}

}  // namespace
}  // namespace hil::signals
