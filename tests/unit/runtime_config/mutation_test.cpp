// Seeded changes to a good scenario. Whatever they make of it: no crash, and every mistake has a file, a line
// and a column.

#include <random>

#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

using testing::ScenarioFolder;

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  std::string mutate(std::string text) {
    for (std::uint64_t changes = 1 + random_() % 4; changes > 0; --changes)
      change(text);
    return text;
  }

 private:
  std::size_t below(std::size_t limit) { return limit == 0 ? 0 : random_() % limit; }

  void change(std::string& text) {
    static constexpr std::string_view pieces[] = {
        "[",   "]",   "{",  "}",        ": ",   "- ",    "\n",    "  ",
        "#",   "&a ", "*a", "!!x",      "<<: ", "\"",    "'",     "|",
        ">",   "%",   "\t", "---",      "~",    "yes",   "1e400", ".nan",
        "010", "-1",  "0",  "\xC3\xA4", "\xFF", "{can.", "and",   "9999999999999999999"};
    const std::size_t at = below(text.size() + 1);
    switch (random_() % 7) {
      case 0:
        text.insert(at, pieces[below(std::size(pieces))]);
        break;
      case 1:
        text.erase(at, below(12));
        break;
      case 2:
        text.insert(at, text.substr(below(text.size()), below(60)));
        break;
      case 3:
        if (at < text.size()) text[at] = static_cast<char>(random_());
        break;
      case 4:
        swap_lines(text);
        break;
      case 5:
        text.erase(text.find('\n', at) == std::string::npos ? at : text.find('\n', at), 1);
        break;
      default:
        text.resize(at > text.size() / 2 ? at : text.size());
        break;
    }
  }

  void swap_lines(std::string& text) {
    const auto line_at = [&](std::size_t from) {
      const std::size_t begin = from == 0 ? 0 : text.rfind('\n', from - 1) + 1;
      const std::size_t end = std::min(text.find('\n', begin), text.size());
      return std::pair(begin, end - begin);
    };
    auto first = line_at(below(text.size()));
    auto second = line_at(below(text.size()));
    if (first.first > second.first) std::swap(first, second);
    if (first.first + first.second > second.first) return;
    const std::string moved = text.substr(second.first, second.second);
    text.replace(second.first, second.second, text.substr(first.first, first.second));
    text.replace(first.first, first.second, moved);
  }

  std::mt19937_64 random_;
};

void expect_places(const Diagnostics& diagnostics, const std::string& text) {
  for (const Mistake& mistake : diagnostics.mistakes()) {
    ASSERT_FALSE(mistake.place.file.empty()) << mistake.message << "\n" << text;
    ASSERT_GE(mistake.place.line, 1U) << mistake.message << "\n" << text;
    ASSERT_GE(mistake.place.column, 1U) << mistake.message << "\n" << text;
    ASSERT_FALSE(mistake.message.empty()) << text;
    ASSERT_EQ(mistake.message.find('\n'), std::string::npos) << mistake.message;
  }
}

TEST(Mutation, ScenariosNeverCrashAndEveryMistakeHasAPlace) {
  const ScenarioFolder files;
  int accepted = 0;
  int refused = 0;
  for (std::uint64_t seed = 0; seed < 3000; ++seed) {
    const std::string text = Mutator(seed).mutate(testing::scenario_text);
    Diagnostics diagnostics;
    const auto scenario = files.load(text, diagnostics);
    ASSERT_EQ(scenario.has_value(), diagnostics.empty()) << "seed " << seed;
    expect_places(diagnostics, text);
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
    ++(scenario ? accepted : refused);
  }
  EXPECT_GT(accepted, 20);  // both ways are walked
  EXPECT_GT(refused, 1500);
}

TEST(Mutation, RegisterMapsNeverCrash) {
  const testing::TemporaryFolder folder;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    const std::string text = Mutator(seed + 1'000'000).mutate(testing::register_map_text);
    Diagnostics diagnostics;
    const auto map = load_register_map(folder.write("map.yaml", text), io::modbus::Role::client, diagnostics);
    ASSERT_EQ(map.has_value(), diagnostics.empty()) << "seed " << seed;
    expect_places(diagnostics, text);
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

TEST(Mutation, OverridesNeverCrash) {
  const ScenarioFolder files;
  for (std::uint64_t seed = 0; seed < 2000; ++seed) {
    Mutator mutator(seed + 2'000'000);
    const std::vector<std::string> overrides{mutator.mutate("tasks.scanner.parameters.columns=96"),
                                             mutator.mutate("dut.command=[a, \"{can.car}\"]"),
                                             mutator.mutate("world.entities.0.position.1=5 m")};
    Diagnostics diagnostics;
    const auto scenario = files.load(testing::scenario_text, diagnostics, overrides);
    ASSERT_EQ(scenario.has_value(), diagnostics.empty()) << "seed " << seed;
    expect_places(diagnostics, overrides[0]);
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
  }
}

TEST(Mutation, ConditionsNeverCrash) {
  const Schema schema = Schema::record({Field::needed("c", Schema::text(), "A condition.")});
  int accepted = 0;
  for (std::uint64_t seed = 0; seed < 5000; ++seed) {
    const std::string condition =
        Mutator(seed + 3'000'000).mutate("a.b > 1 and not (c == d or 2.5 <= e) or f != -1e3");
    const std::string text = "c: >-\n  " + condition + "\n";
    Diagnostics diagnostics;
    const auto value = parse_text("f.yaml", text, schema, diagnostics);
    if (value && Condition::parse((*value)["c"], diagnostics)) ++accepted;
    expect_places(diagnostics, text);
    if (::testing::Test::HasFatalFailure()) FAIL() << "seed " << seed;
  }
  EXPECT_GT(accepted, 100);
}

}  // namespace
}  // namespace hil::config
