// Seeded changes of a good scenario: none crashes the reader, and every mistake has a file, a line and a
// column.

#include "scenario_fixture.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/text_mutator.hpp"

namespace hil::config {
namespace {

using buses::modbus::load_register_map;
using test::ScenarioFolder;
using tests::TextMutator;

void expect_places(const Diagnostics& diagnostics, const std::string& text) {
  for (const Mistake& mistake : diagnostics.mistakes()) {
    ASSERT_FALSE(mistake.place.file.empty()) << mistake.message << "\n" << text;
    ASSERT_GE(mistake.place.line, 1U) << mistake.message << "\n" << text;
    ASSERT_GE(mistake.place.column, 1U) << mistake.message << "\n" << text;
    ASSERT_FALSE(mistake.message.empty()) << text;
    ASSERT_EQ(mistake.message.find('\n'), std::string::npos) << mistake.message;
  }
}

TEST(Mutation, OfScenariosNeverCrashesAndMistakesHaveAPlace) {
  const ScenarioFolder files;
  std::uint64_t accepted = 0;
  std::uint64_t refused = 0;
  const std::uint64_t seeds = hil::tests::rounds(1000, 20'000);
  for (std::uint64_t seed = 0; seed < seeds; ++seed) {
    const std::string text = TextMutator(seed).mutate(test::scenario_text);
    Diagnostics diagnostics;
    const auto scenario = files.load(text, diagnostics);
    ASSERT_EQ(scenario.has_value(), diagnostics.empty()) << "seed " << seed;
    expect_places(diagnostics, text);
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
    ++(scenario ? accepted : refused);
  }
  EXPECT_GT(accepted, 0u);  // both results occur
  EXPECT_GT(refused, seeds / 2);
}

TEST(Mutation, OfRegisterMapsNeverCrashes) {
  const tests::TemporaryFolder folder;
  for (std::uint64_t seed = 0; seed < hil::tests::rounds(1000, 20'000); ++seed) {
    const std::string text = TextMutator(seed + 1'000'000).mutate(test::register_map_text);
    Diagnostics diagnostics;
    const auto map = load_register_map(folder.write("map.yaml", text), io::modbus::Role::client, diagnostics);
    ASSERT_EQ(map.has_value(), diagnostics.empty()) << "seed " << seed;
    expect_places(diagnostics, text);
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

TEST(Mutation, OfOverridesNeverCrashes) {
  const ScenarioFolder files;
  for (std::uint64_t seed = 0; seed < hil::tests::rounds(600, 20'000); ++seed) {
    TextMutator mutator(seed + 2'000'000);
    const std::vector<std::string> overrides{mutator.mutate("tasks.scanner.parameters.columns=96"),
                                             mutator.mutate("dut.command=[a, \"{can.car}\"]"),
                                             mutator.mutate("world.entities.0.position.1=5 m")};
    Diagnostics diagnostics;
    const auto scenario = files.load(test::scenario_text, diagnostics, overrides);
    ASSERT_EQ(scenario.has_value(), diagnostics.empty()) << "seed " << seed;
    expect_places(diagnostics, overrides[0]);
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

TEST(Mutation, OfConditionsNeverCrashes) {
  const Schema schema = Schema::record({Field::needed("c", Schema::text(), "A condition.")});
  int accepted = 0;
  for (std::uint64_t seed = 0; seed < hil::tests::rounds(2000); ++seed) {
    const std::string condition =
        TextMutator(seed + 3'000'000).mutate("a.b > 1 and not (c == d or 2.5 <= e) or f != -1e3");
    const std::string text = "c: >-\n  " + condition + "\n";
    Diagnostics diagnostics;
    const auto value = parse_text("f.yaml", text, schema, diagnostics);
    if (value && Expression::parse((*value)["c"], diagnostics)) ++accepted;
    expect_places(diagnostics, text);
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
  }
  EXPECT_GT(accepted, 4);
}

}  // namespace
}  // namespace hil::config
