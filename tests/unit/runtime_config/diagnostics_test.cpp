#include "config_fixture.hpp"

namespace hil::config {
namespace {

const std::vector<std::string> keys{"columns", "rows", "rate", "duration", "deadline"};

TEST(Nearest, FindsOneTypingErrorOfEachKind) {
  EXPECT_EQ(nearest("colums", keys), "columns");    // left out
  EXPECT_EQ(nearest("collumns", keys), "columns");  // too many
  EXPECT_EQ(nearest("cokumns", keys), "columns");   // replaced
  EXPECT_EQ(nearest("coulmns", keys), "columns");   // swapped
  EXPECT_EQ(nearest("COLUMNS", keys), "columns");   // case
  EXPECT_EQ(nearest("raet", keys), "rate");         // swapped in a short word
}

TEST(Nearest, IsEmptyWithoutASimilarName) {
  EXPECT_EQ(nearest("zebra", keys), "");
  EXPECT_EQ(nearest("", keys), "");
  EXPECT_EQ(nearest("x", {"y"}), "");  // one error, but in the whole word
  EXPECT_EQ(nearest("rate", {}), "");
  EXPECT_EQ(nearest(std::string(256, 'a'), {std::string(256, 'a') + "b"}), "");
  EXPECT_EQ(nearest(std::string(255, 'a'), {std::string(254, 'a')}), std::string(254, 'a'));
}

TEST(Nearest, IsTheFirstOfSeveralEquallyNear) {
  EXPECT_EQ(nearest("cat", {"bat", "hat"}), "bat");
}

TEST(Nearest, IsSymmetricInDistance) {
  // A swap counts as one error, so both words of a pair find each other or neither does.
  const std::vector<std::string> words{"abcd", "abdc", "acbd", "badc", "abcde", "xyz", "abc"};
  for (const std::string& one : words) {
    for (const std::string& other : words) {
      if (one.size() != other.size()) continue;
      EXPECT_EQ(nearest(one, {other}).empty(), nearest(other, {one}).empty()) << one << " " << other;
    }
  }
}

TEST(Suggestion, IsTheNearestNameOrAllNames) {
  EXPECT_EQ(suggestion("rat", keys), "; did you mean 'rate'?");
  EXPECT_EQ(suggestion("zebra", {"a", "b"}), "; known here: a, b");
  EXPECT_EQ(suggestion("zebra", {}), "");
}

TEST(InQuotes, TextIsShortenedWithoutControlCharacters) {
  EXPECT_EQ(in_quotes("a\tb\x01"), "'a?b?'");
  EXPECT_EQ(in_quotes(std::string(61, 'x')), "'" + std::string(60, 'x') + "...'");
  // 59 letters and a character of two bytes: cut before it, not inside it.
  EXPECT_EQ(in_quotes(std::string(59, 'x') + "\xC3\xA4" + "y"), "'" + std::string(59, 'x') + "...'");
}

TEST(Diagnostics, ArePrintedInFileOrder) {
  Diagnostics diagnostics;
  diagnostics.add({"gone.yaml", 0, 0}, "there is no such file");
  diagnostics.add({"b.yaml", 9, 1}, "late");
  diagnostics.add({"a.yaml", 1, 1}, "other file");
  diagnostics.add({"b.yaml", 2, 8}, "right");
  diagnostics.add({"b.yaml", 2, 3}, "left");
  EXPECT_EQ(diagnostics.to_text(),
            "gone.yaml: there is no such file\nb.yaml:2:3: left\nb.yaml:2:8: right\nb.yaml:9:1: late\n"
            "a.yaml:1:1: other file\n");
}

TEST(Diagnostics, WarningsArePrintedInOrderAndRefuseNothing) {
  Diagnostics diagnostics;
  diagnostics.warn({"a.yaml", 5, 3}, "unused");
  EXPECT_TRUE(diagnostics.empty());
  EXPECT_EQ(diagnostics.count(), 0U);
  EXPECT_EQ(diagnostics.to_text(), "a.yaml:5:3: warning: unused\n");
  diagnostics.add({"a.yaml", 2, 1}, "wrong");
  diagnostics.add({"a.yaml", 9, 1}, "wrong as well");
  EXPECT_EQ(diagnostics.warning_count(), 1U);
  EXPECT_EQ(diagnostics.count(), 2U);
  EXPECT_EQ(diagnostics.to_text(),
            "a.yaml:2:1: wrong\na.yaml:5:3: warning: unused\na.yaml:9:1: wrong as well\n");
}

TEST(Diagnostics, AreKeptUpToACapacityAndCountedBeyond) {
  Diagnostics diagnostics;
  EXPECT_TRUE(diagnostics.empty());
  for (std::size_t i = 0; i < Diagnostics::capacity + 3; ++i)
    diagnostics.warn({"f", 1, 1}, "x");
  EXPECT_FALSE(diagnostics.full());
  EXPECT_EQ(diagnostics.warnings().size(), Diagnostics::capacity);
  EXPECT_TRUE(diagnostics.to_text().ends_with("\n3 more warnings are not shown\n"));
  for (std::size_t i = 0; i < Diagnostics::capacity + 7; ++i)
    diagnostics.add({"f", 1, 1}, "x");
  EXPECT_TRUE(diagnostics.full());
  EXPECT_EQ(diagnostics.mistakes().size(), Diagnostics::capacity);
  EXPECT_EQ(diagnostics.count(), Diagnostics::capacity + 7);
  EXPECT_NE(diagnostics.to_text().find("\n7 more mistakes are not shown\n"), std::string::npos);
}

}  // namespace
}  // namespace hil::config
