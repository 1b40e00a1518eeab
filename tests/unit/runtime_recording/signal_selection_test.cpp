#include "runtime/recording/signal_selection.hpp"

#include <gtest/gtest.h>

namespace hil::recording {
namespace {

TEST(SignalPattern, StarStandsForAnyCharacters) {
  EXPECT_TRUE(matches("*", ""));
  EXPECT_TRUE(matches("*", "a.b"));
  EXPECT_TRUE(matches("plant.*", "plant.tank.level"));
  EXPECT_TRUE(matches("plant.*", "plant."));
  EXPECT_FALSE(matches("plant.*", "plant2.level"));
  EXPECT_FALSE(matches("plant.*", "my.plant.level"));
  EXPECT_TRUE(matches("*.level", "a.b.level"));
  EXPECT_FALSE(matches("*.level", "a.b.level.faulted"));
  EXPECT_TRUE(matches("a*b*c", "a-b-b-c-c"));
  EXPECT_FALSE(matches("a*b*c", "a-c-b"));
  EXPECT_TRUE(matches("**a**", "ba"));
  EXPECT_TRUE(matches("a.b", "a.b"));
  EXPECT_FALSE(matches("a.b", "a.bc"));
  EXPECT_FALSE(matches("a.b", "aXb"));
  EXPECT_FALSE(matches("", "a"));
}

struct Selection {
  explicit Selection(const std::vector<std::string>& patterns) {
    for (const char* name : {"plant.level", "plant.flow", "plc.level", "speed"})
      table.add({.name = name, .unit = "", .writer = ""});
    table.add_alias("plant.L", {0});
    signals::KnownSignals known(table);
    known.add_undeclared("broken.");
    config::Recording section;
    for (const std::string& pattern : patterns)
      section.signals.push_back({pattern, {}});
    for (const signals::SignalId signal : selected_signals(section, known, diagnostics))
      names.push_back(table.info(signal).name);
  }
  signals::SignalTable table;
  config::Diagnostics diagnostics;
  std::vector<std::string> names;
};

TEST(SignalSelection, HasEachSignalOnceInTheOrderOfTheTable) {
  using Names = std::vector<std::string>;
  EXPECT_EQ(Selection({"*"}).names, (Names{"plant.level", "plant.flow", "plc.level", "speed"}));
  EXPECT_EQ(Selection({"speed", "*.level", "plant.level"}).names,
            (Names{"plant.level", "plc.level", "speed"}));
  EXPECT_EQ(Selection({"plant.L"}).names, (Names{"plant.level"})) << "an alias";
  EXPECT_TRUE(Selection({}).names.empty());
}

TEST(SignalSelection, NamesAndPatternsWithoutASignalAreMistakes) {
  const Selection selection({"plant.levle", "tank.*", "broken.x", "broken.*"});
  EXPECT_EQ(selection.diagnostics.count(), 2U) << selection.diagnostics.to_text();
  EXPECT_NE(selection.diagnostics.to_text().find("there is no signal 'plant.levle'"), std::string::npos);
  EXPECT_NE(selection.diagnostics.to_text().find("no signal has a name like 'tank.*'"), std::string::npos);
}

TEST(SignalSelection, StarAloneSelectsNothingInAScenarioWithoutSignals) {
  signals::SignalTable table;
  config::Diagnostics diagnostics;
  EXPECT_TRUE(selected_signals({.signals = {{"*", {}}}}, signals::KnownSignals(table), diagnostics).empty());
  EXPECT_TRUE(diagnostics.empty());
}

}  // namespace
}  // namespace hil::recording
