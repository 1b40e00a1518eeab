#include "runtime/config/condition.hpp"

#include <limits>
#include <random>

#include "config_fixture.hpp"

namespace hil::config {
namespace {

using test::is_only_mistake;

std::optional<Condition> parse(const std::string& written, Diagnostics& diagnostics) {
  const Schema schema = Schema::record({Field::needed("never", Schema::text(), "A condition.")});
  const std::optional<Value> value = parse_text("f.yaml", "never: " + written, schema, diagnostics);
  if (!value) return std::nullopt;
  return Condition::parse((*value)["never"], diagnostics);
}

/// For a = 1, b = 2, c.d = NaN.
bool holds(const std::string& written) {
  Diagnostics diagnostics;
  const std::optional<Condition> condition = parse(written, diagnostics);
  if (!condition) throw std::runtime_error(diagnostics.to_text());
  std::vector<std::uint32_t> indices;
  for (const Word& mention : condition->mentions()) {
    indices.push_back(mention.text == "a" ? 0 : mention.text == "b" ? 1 : 2);
  }
  const double values[] = {1.0, 2.0, std::numeric_limits<double>::quiet_NaN()};
  return condition->bind(indices).holds(values);
}

Diagnostics mistakes_in(const std::string& written) {
  Diagnostics diagnostics;
  EXPECT_FALSE(parse(written, diagnostics)) << written;
  return diagnostics;
}

TEST(Condition, ComparesNumbers) {
  for (const char* held : {"a == 1", "a != b", "a < b", "a <= 1", "b > -3", "2.0 >= b", "a<b", "a == +1e0"})
    EXPECT_TRUE(holds(held)) << held;
  for (const char* failed : {"a==2", "a>b"})
    EXPECT_FALSE(holds(failed)) << failed;
  for (const char* sign : {"==", "<", "<=", ">", ">="})
    EXPECT_FALSE(holds(std::string("c.d ") + sign + " 0")) << "NaN " << sign;
  EXPECT_TRUE(holds("c.d != 0")) << "NaN";
  EXPECT_TRUE(holds("not c.d < 0")) << "NaN";
}

/// For a = 1 and b unknown.
Truth truth(const std::string& written) {
  Diagnostics diagnostics;
  const std::optional<Condition> condition = parse(written, diagnostics);
  if (!condition) throw std::runtime_error(diagnostics.to_text());
  std::vector<std::uint32_t> indices;
  for (const Word& mention : condition->mentions())
    indices.push_back(mention.text == "a" ? 0 : 1);
  const double values[] = {1.0, 1.0};
  const std::uint8_t unknown[] = {0, 1};
  return condition->bind(indices).truth(values, unknown);
}

TEST(Condition, IsUnknownWhereAnUnknownSignalDecides) {
  EXPECT_EQ(truth("a == 1"), Truth::yes);
  EXPECT_EQ(truth("a == 2"), Truth::no);
  EXPECT_EQ(truth("b == 1"), Truth::unknown);
  EXPECT_EQ(truth("a == b"), Truth::unknown);
  EXPECT_EQ(truth("not b == 1"), Truth::unknown);
  EXPECT_EQ(truth("a == 1 and b == 1"), Truth::unknown);
  EXPECT_EQ(truth("b == 1 and a == 2"), Truth::no);
  EXPECT_EQ(truth("a == 2 and b == 1"), Truth::no);
  EXPECT_EQ(truth("b == 1 or a == 1"), Truth::yes);
  EXPECT_EQ(truth("a == 2 or b == 1"), Truth::unknown);
  EXPECT_EQ(truth("not (b == 1 or a == 1)"), Truth::no);
  EXPECT_EQ(truth("b == 1 or b != 1"), Truth::unknown) << "each comparison is evaluated separately";
}

TEST(Condition, JoinsComparisonsByPrecedence) {
  EXPECT_TRUE(holds("a == 1 or a == 9 and a == 8"));  // and first
  EXPECT_FALSE(holds("(a == 1 or a == 9) and a == 8"));
  EXPECT_TRUE(holds("not a == 2 and b == 2"));  // not first
  EXPECT_FALSE(holds("not (a == 2 or b == 2)"));
  EXPECT_TRUE(holds("not not a == 1"));
  EXPECT_TRUE(holds("((a == 1))"));
}

TEST(Condition, KeepsEveryMentionWithItsPlace) {
  Diagnostics diagnostics;
  const auto condition = parse("\"a > b or can.x.Y < z.a\"", diagnostics);
  ASSERT_TRUE(condition) << diagnostics.to_text();
  const auto& mentions = condition->mentions();
  ASSERT_EQ(mentions.size(), 4U);
  EXPECT_EQ(mentions[0].text, "a");
  EXPECT_EQ(mentions[0].place, (Place{"f.yaml", 1, 9}));
  EXPECT_EQ(mentions[2].text, "can.x.Y");
  EXPECT_EQ(mentions[2].place, (Place{"f.yaml", 1, 18}));
  EXPECT_EQ(mentions[3].place, (Place{"f.yaml", 1, 28}));
  EXPECT_EQ(condition->text(), "a > b or can.x.Y < z.a");
}

TEST(Condition, ReadsValueNamesBesideASignal) {
  Diagnostics diagnostics;
  const auto condition =
      parse("\"can.x.Y == LimpHome and 'on, off' != can.x.Z and On == can.x.W and a < b\"", diagnostics);
  ASSERT_TRUE(condition) << diagnostics.to_text();
  const auto& mentions = condition->mentions();
  ASSERT_EQ(mentions.size(), 5U);
  EXPECT_EQ(mentions[0].text, "can.x.Y");
  EXPECT_EQ(mentions[1].text, "can.x.Z");
  EXPECT_EQ(mentions[2].text, "can.x.W");
  EXPECT_EQ(mentions[3].text, "a");
  const auto& named = condition->named_values();
  ASSERT_EQ(named.size(), 3U);
  EXPECT_EQ(named[0].name.text, "LimpHome");
  EXPECT_EQ(named[0].mention, 0U);
  EXPECT_EQ(named[0].name.place, (Place{"f.yaml", 1, 20}));
  EXPECT_EQ(named[1].name.text, "on, off");
  EXPECT_EQ(named[1].mention, 1U);
  EXPECT_EQ(named[2].name.text, "On");
  EXPECT_EQ(named[2].mention, 2U);
  const std::uint32_t indices[] = {0, 1, 2, 3, 4};
  const double numbers[] = {7.0, 8.0, 9.0};
  const BoundCondition bound = condition->bind(indices, numbers);
  EXPECT_TRUE(bound.holds(std::vector<double>{7.0, 0.0, 9.0, 1.0, 2.0}));
  EXPECT_FALSE(bound.holds(std::vector<double>{7.0, 8.0, 9.0, 1.0, 2.0}));
  EXPECT_FALSE(bound.holds(std::vector<double>{6.0, 0.0, 9.0, 1.0, 2.0}));
  EXPECT_FALSE(bound.holds(std::vector<double>{7.0, 0.0, 1.0, 1.0, 2.0}));
}

TEST(Condition, HasPlacesInFoldedText) {
  Diagnostics diagnostics;
  const auto condition = parse(">\n  a > 1\n  and b < 2\n", diagnostics);
  ASSERT_TRUE(condition) << diagnostics.to_text();
  EXPECT_EQ(condition->mentions()[1].place, (Place{"f.yaml", 3, 7}));
}

TEST(Condition, MistakesHaveTheirPlace) {
  const std::tuple<const char*, std::uint32_t, const char*> mistakes[] = {
      {"a >", 11, "the condition ends where a signal or a number is expected"},
      {"a", 9, "the condition ends where a comparison"},
      {"a == 1 && b == 2", 15, "found '&'; write and"},
      {"\"a == 1 || b == 2\"", 16, "write or"},
      {"\"! a == 1\"", 9, "write not"},
      {"a = 1", 10, "write =="},
      {"1 < a < 2", 14, "can not be chained"},
      {"1 < 2", 8, "two constants"},
      {"1 < 'two'", 8, "at least one side has to be a signal"},
      {"a.b == 'open", 15, "not closed"},
      {"a > 50 km/h", 15, "found 'km'"},
      {"a > 50km", 14, "numbers have no unit here"},
      {"(a > 1", 14, "the condition ends where 'and', 'or' or ')'"},
      {"a > 1)", 13, "found ')'"},
      {"a > 1 b < 2", 14, "found 'b'"},
      {"a > 010", 12, "leading zero"},
      {"a > 1e400", 12, "too large"},
      {"a..b > 1", 8, "'a..b' is not a signal's name"},
      {"a > and", 12, "found 'and'"},
      {"a > $", 12, "found '$'"},
  };
  for (const auto& [written, column, words] : mistakes)
    EXPECT_TRUE(is_only_mistake(mistakes_in(written), 1, column, words)) << written;
}

TEST(Condition, LimitsAreExact) {
  std::string largest = "a == 0";
  for (std::size_t i = 1; i < Condition::max_comparisons; ++i)
    largest += " or a == 0";
  EXPECT_FALSE(holds(largest));
  EXPECT_TRUE(is_only_mistake(mistakes_in(largest + " or a == 1"), 1,
                              static_cast<std::uint32_t>(8 + largest.size() + 4),
                              "more than 256 comparisons"));
  const auto nested = [](std::size_t levels) {
    return std::string(levels, '(') + "a == 1" + std::string(levels, ')');
  };
  EXPECT_TRUE(holds(nested(Condition::max_nesting)));
  EXPECT_TRUE(is_only_mistake(mistakes_in(nested(Condition::max_nesting + 1)), 1, 8 + Condition::max_nesting,
                              "nested deeper than 32"));
  EXPECT_TRUE(
      is_only_mistake(mistakes_in("a == 1" + std::string(Condition::max_text_bytes, ' ') + "or b == 1"), 1, 8,
                      "at most 8192 bytes"));
}

/// A random condition as text, and its result for the values of a and b.
struct Expected {
  std::string text;
  bool holds = false;
};

Expected random_condition(std::mt19937& random, int depth, double a, double b) {
  if (depth == 0 || random() % 3 == 0) {
    const int number = static_cast<int>(random() % 5) - 2;
    switch (random() % 4) {
      case 0:
        return {"a < " + std::to_string(number), a < number};
      case 1:
        return {"b >= " + std::to_string(number), b >= number};
      case 2:
        return {"a == b", a == b};
      default:
        return {std::to_string(number) + " != a", number != a};
    }
  }
  const Expected left = random_condition(random, depth - 1, a, b);
  if (random() % 4 == 0) return {"not (" + left.text + ")", !left.holds};
  const Expected right = random_condition(random, depth - 1, a, b);
  if (random() % 2 == 0) return {"(" + left.text + ") and (" + right.text + ")", left.holds && right.holds};
  return {"(" + left.text + ") or (" + right.text + ")", left.holds || right.holds};
}

TEST(Condition, RandomConditionsHaveTheExpectedResult) {
  std::mt19937 random(7);
  int true_ones = 0;
  for (int i = 0; i < 500; ++i) {
    const double a = static_cast<double>(random() % 5) - 2.0;
    const double b = static_cast<double>(random() % 5) - 2.0;
    const Expected expected = random_condition(random, 4, a, b);
    Diagnostics diagnostics;
    const auto condition = parse("\"" + expected.text + "\"", diagnostics);
    ASSERT_TRUE(condition) << expected.text << diagnostics.to_text();
    std::vector<std::uint32_t> indices;
    for (const Word& mention : condition->mentions())
      indices.push_back(mention.text == "a" ? 1 : 0);
    const double values[] = {b, a};
    ASSERT_EQ(condition->bind(indices).holds(values), expected.holds)
        << expected.text << " a " << a << " b " << b;
    true_ones += expected.holds ? 1 : 0;
  }
  EXPECT_GT(true_ones, 100);
  EXPECT_LT(true_ones, 400);
}

TEST(Condition, MisuseIsAsserted) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  Diagnostics diagnostics;
  const auto condition = parse("a > b", diagnostics);
  ASSERT_TRUE(condition);
  const std::uint32_t one_index[] = {0};
  EXPECT_DEATH(condition->bind(one_index), "one index for each mention");
  const std::uint32_t indices[] = {0, 5};
  const double values[] = {1, 2};
  const BoundCondition bound = condition->bind(indices);
  EXPECT_DEATH(bound.holds(values), "a value for each signal");
}

}  // namespace
}  // namespace hil::config
