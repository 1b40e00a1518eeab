// How a signal's values are converted for its readers.

#include "runtime/signals/known_signals.hpp"

#include <gtest/gtest.h>

namespace hil::signals {
namespace {

class KnownSignalsTest : public ::testing::Test {
 protected:
  units::Conversion conversion(const std::string& unit, const std::string& unit_of_reader) {
    const SignalId signal =
        table_.add({.name = "s" + std::to_string(table_.size()), .unit = unit, .writer = "test"});
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

TEST_F(KnownSignalsTest, WithoutAUnitNothingIsConverted) {
  EXPECT_TRUE(conversion("", "m/s").is_identity());
  EXPECT_TRUE(conversion("km/h", "").is_identity());
  EXPECT_TRUE(conversion("steps", "steps").is_identity());
  EXPECT_TRUE(known_.conversion_for({}, "reader", "m", {}, diagnostics_).is_identity());
  EXPECT_TRUE(diagnostics_.empty()) << diagnostics_.to_text();
}

TEST_F(KnownSignalsTest, OtherUnitsAreMistakes) {
  conversion("m", "m/s");
  conversion("steps", "m");
  conversion("m", "Unit_Metre");
  const std::string text = diagnostics_.to_text();
  EXPECT_NE(text.find("'s0' is in m, but 'reader' is in m/s\n"), std::string::npos) << text;
  EXPECT_NE(text.find("'s1' is in steps, but 'reader' is in m; 'steps' is not a known unit"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("'s2' is in m, but 'reader' is in Unit_Metre; 'Unit_Metre' is not a known unit"),
            std::string::npos)
      << text;
}

}  // namespace
}  // namespace hil::signals
