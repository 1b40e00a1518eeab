// hil check on seeded changes to a scenario, its CAN database and its register map: whatever they make of the
// files, it ends with 0 or 2, never by an assertion or a signal. Half of the changes keep the syntax (numbers,
// words, whole lines), so that they reach the parts behind the parsers.

#include <gtest/gtest.h>

#include <cctype>
#include <random>

#include "tests/scenario/hil.hpp"

namespace hil::scenario_test {
namespace {

class Mutator {
 public:
  explicit Mutator(std::uint64_t seed) : random_(seed) {}

  std::string mutate(std::string text) {
    for (std::size_t changes = 1 + below(3); changes > 0; --changes)
      change(text);
    return text;
  }

 private:
  struct Part {
    std::size_t at = 0;
    std::size_t length = 0;
  };

  std::size_t below(std::size_t limit) { return limit == 0 ? 0 : random_() % limit; }

  void change(std::string& text) {
    static constexpr const char* numbers[] = {
        "0",   "1",      "-1",    "64",         "65",    "255",    "65536",
        "1e9", "-1e308", "1e308", "4294967296", "0.001", "1e-300", "9223372036854775808"};
    static constexpr const char* pieces[] = {"",  " ", "\n", "\t", ":", "{", "}",
                                             "[", "]", "\"", "|",  "@", "-", "\xE4"};
    switch (below(8)) {
      case 0:
      case 1:
      case 2:
        replace(text, part(text, is_digit), numbers[below(std::size(numbers))]);
        break;
      case 3: {
        const Part other = part(text, is_letter);
        replace(text, part(text, is_letter), text.substr(other.at, other.length));
        break;
      }
      case 4:
        replace(text, line(text), "");
        break;
      case 5: {
        const Part copied = line(text);
        text.insert(line(text).at, text.substr(copied.at, copied.length));
        break;
      }
      default:
        replace(text, {below(text.size()), below(3)}, pieces[below(std::size(pieces))]);
    }
  }

  static bool is_digit(char letter) { return std::isdigit(static_cast<unsigned char>(letter)) != 0; }
  static bool is_letter(char letter) {
    return std::isalpha(static_cast<unsigned char>(letter)) != 0 || letter == '_';
  }

  /// The first run of such letters from some place on; empty when there is none.
  Part part(const std::string& text, bool (*belongs)(char)) {
    std::size_t at = below(text.size());
    while (at < text.size() && !belongs(text[at]))
      ++at;
    std::size_t end = at;
    while (end < text.size() && belongs(text[end]))
      ++end;
    return {at, end - at};
  }
  /// With its line end.
  Part line(const std::string& text) {
    const std::size_t at = below(text.size());
    const std::size_t begin = at == 0 ? 0 : text.rfind('\n', at - 1) + 1;
    const std::size_t end = text.find('\n', at);
    return {begin, (end == std::string::npos ? text.size() : end + 1) - begin};
  }
  static void replace(std::string& text, Part part, const std::string& by) {
    if (part.at <= text.size()) text.replace(part.at, part.length, by);
  }

  std::mt19937_64 random_;
};

void check_mutants(const std::string& name, std::uint64_t first_seed, std::uint64_t count) {
  const ScenarioCopy copy;
  const std::string file = copy.folder() / name;
  const std::string good = read_text(file);
  std::uint64_t accepted = 0;
  for (std::uint64_t seed = first_seed; seed < first_seed + count; ++seed) {
    const std::string text = Mutator(seed).mutate(good);
    write_text(file, text);
    const Ended ended = run_hil({"check", copy.file()});
    ASSERT_TRUE(ended.code == 0 || ended.code == 2)
        << name << ", seed " << seed << ": exit " << ended.code << "\n"
        << ended.errors << text;
    accepted += ended.code == 0 ? 1 : 0;
  }
  EXPECT_GT(accepted, count / 50);  // both ways are walked
  EXPECT_LT(accepted, count);
}

TEST(CheckOfMutants, OfAScenarioEndsWith0Or2) {
  check_mutants("crossing.yaml", 0, 1000);
}

TEST(CheckOfMutants, OfACanDatabaseEndsWith0Or2) {
  check_mutants("crossing.dbc", 10'000, 500);
}

TEST(CheckOfMutants, OfARegisterMapEndsWith0Or2) {
  check_mutants("crossing_plc.yaml", 20'000, 500);
}

}  // namespace
}  // namespace hil::scenario_test
