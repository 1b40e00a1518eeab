// Input that is made to exhaust the reader is refused with a place, in bounded time.

#include <sys/stat.h>

#include <ctime>
#include <functional>
#include <random>
#include <sstream>

#include "runtime/contract/source_text.hpp"
#include "runtime/contract/tree.hpp"
#include "scenario_fixture.hpp"

namespace hil::config {
namespace {

using test::is_only_mistake;
using tests::TemporaryFolder;

/// Loads the text as a scenario, which has to be refused in time.
Diagnostics refusal_of(const std::string& text) {
  const TemporaryFolder folder;
  const std::string file = folder.write("hostile.yaml", text);
  Diagnostics diagnostics;
  const std::clock_t begin = std::clock();  // processor time, since other tests may run
  EXPECT_FALSE(load_scenario(file, {}, test::test_scenario_types(), diagnostics));
  const double took_s = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || !defined(NDEBUG)
  constexpr double limit_s = 30.0;  // these builds are slower by this factor
#else
  constexpr double limit_s = 2.0;
#endif
  EXPECT_LT(took_s, limit_s);
  EXPECT_FALSE(diagnostics.empty());
  return diagnostics;
}

std::string noise(std::size_t bytes, std::uint32_t seed, const std::function<char(std::mt19937&)>& letter) {
  std::mt19937 random(seed);
  std::string text(bytes, '\0');
  for (char& place : text)
    place = letter(random);
  return text;
}

std::string repeated(const std::string& piece, std::size_t bytes) {
  std::string text;
  text.reserve(bytes + piece.size());
  while (text.size() + piece.size() <= bytes)
    text += piece;
  return text;
}

TEST(HostileInput, TooLargeFileIsRefused) {
  const std::string text =
      noise(10'000'000, 1, [](std::mt19937& random) { return static_cast<char>(random()); });
  EXPECT_TRUE(is_only_mistake(refusal_of(text), 0, 0,
                              "is too large: 10000000 bytes, and at most 1 MiB (1048576 bytes) are read"));
}

TEST(HostileInput, TooLargeTextIsRefused) {
  Diagnostics diagnostics;
  EXPECT_FALSE(parse_text("text", std::string(max_file_bytes + 1, ' '), scenario_schema({}), diagnostics));
  EXPECT_TRUE(is_only_mistake(diagnostics, 0, 0, "is too large"));
}

TEST(HostileInput, NoiseOfTheLargestSizeIsRefusedInTime) {
  refusal_of(noise(max_file_bytes, 2, [](std::mt19937& random) { return static_cast<char>(random()); }));
  refusal_of(
      noise(max_file_bytes, 3, [](std::mt19937& random) { return static_cast<char>(32 + random() % 95); }));
  refusal_of(noise(max_file_bytes, 4,
                   [](std::mt19937& random) { return "[]{},:- \n\"'#&*!|>?%@`abc123"[random() % 27]; }));
  refusal_of(noise(max_file_bytes, 5, [](std::mt19937& random) { return "ab \n:-"[random() % 6]; }));
}

TEST(HostileInput, RegularTextOfTheLargestSizeIsRefusedInTime) {
  for (const std::string piece :
       {"a",      " ",     "\n",      "#",    "- ",        "-\n", "a: ",   "a:\n", "[",       "{",   "[a,",
        "{a: ",   "'",     "\"",      "? ",   "? a\n",     "!a ", "&a ",   "*a ",  "|\n",     "a\n", " a\n",
        "a: b\n", "- a\n", "- - a\n", "[a],", "\"\\u0041", "%",   "---\n", "a b ", "\xC3\xA4"}) {
    SCOPED_TRACE(piece);
    refusal_of(repeated(piece, max_file_bytes));
    refusal_of("tasks: " + repeated(piece, max_file_bytes - 7));
  }
}

TEST(HostileInput, ManyUnknownKeysAreCountedAndNotKept) {
  std::string text = "scenario: many\n";
  for (int i = 0; i < 50'000; ++i)
    text += "key_" + std::to_string(i) + ": 1\n";
  const Diagnostics diagnostics = refusal_of(text);
  EXPECT_EQ(diagnostics.mistakes().size(), Diagnostics::capacity);
}

TEST(HostileInput, DepthIsLimited) {
  const auto nested = [](std::size_t levels) {
    return "tasks: [{module: m, type: vehicles, rate: 1 Hz, parameters: " + std::string(levels, '[') +
           std::string(levels, ']') + "}]";
  };
  // The document's mapping, the list and the task come first; the value of `parameters` begins on level 4.
  EXPECT_TRUE(is_only_mistake(refusal_of("scenario: deep\n" + nested(max_tree_depth - 2)), 2, 122,
                              "nested deeper than 64 levels"));
  const Diagnostics allowed = refusal_of("scenario: deep\n" + nested(max_tree_depth - 3));
  EXPECT_EQ(allowed.to_text().find("nested deeper"), std::string::npos);
  refusal_of(std::string(1'000'000, '['));
  refusal_of(repeated("{a: ", 1'000'000));
}

TEST(HostileInput, ExponentialAliasesAreRefused) {
  std::ostringstream text;
  text << "scenario: lol\nl0: &l0 [lol, lol, lol, lol, lol, lol, lol, lol, lol, lol]\n";
  for (int i = 1; i <= 9; ++i) {
    text << "l" << i << ": &l" << i << " [*l" << i - 1;
    for (int k = 0; k < 9; ++k)
      text << ", *l" << i - 1;
    text << "]\n";
  }
  const Diagnostics diagnostics = refusal_of(text.str());
  ASSERT_EQ(diagnostics.count(), 1U) << diagnostics.to_text();
  EXPECT_NE(diagnostics.to_text().find("at most 250000 values"), std::string::npos);
  EXPECT_GT(diagnostics.mistakes()[0].place.line, 3U);
}

TEST(HostileInput, ManyAliasesOfALongTextAreRefused) {
  std::string text = "scenario: long\na: &a " + std::string(1'000'000, 'x') + "\nb: [*a";
  for (int i = 0; i < 1000; ++i)
    text += ", *a";
  const Diagnostics diagnostics = refusal_of(text + "]\n");
  EXPECT_NE(diagnostics.to_text().find("bytes of values"), std::string::npos);
}

TEST(HostileInput, DepthThroughAliasesIsLimited) {
  std::ostringstream text;
  text << "scenario: deep\na0: &a0 [x]\n";
  for (int i = 1; i < 70; ++i)
    text << "a" << i << ": &a" << i << " [*a" << i - 1 << "]\n";
  EXPECT_NE(refusal_of(text.str()).to_text().find("nested deeper than 64 levels"), std::string::npos);
}

TEST(HostileInput, FifoDoesNotBlock) {
  const TemporaryFolder folder;
  const std::string fifo = (folder.path() / "fifo").string();
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  Diagnostics diagnostics;
  EXPECT_FALSE(load_scenario(fifo, {}, {}, diagnostics));
  EXPECT_TRUE(is_only_mistake(diagnostics, 0, 0, "is not a regular file"));
}

}  // namespace
}  // namespace hil::config
