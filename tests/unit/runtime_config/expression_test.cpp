// The expression language as a tree: its grammar and the places of its mistakes.

#include "runtime/config/expression.hpp"

#include "config_fixture.hpp"

namespace hil::config {
namespace {

using test::is_only_mistake;
using Operation = Expression::Operation;

std::optional<Expression> parse(const std::string& written, Diagnostics& diagnostics) {
  const Schema schema = Schema::record({Field::needed("never", Schema::text(), "A condition.")});
  const std::optional<Value> value = parse_text("f.yaml", "never: " + written, schema, diagnostics);
  if (!value) return std::nullopt;
  return Expression::parse((*value)["never"], diagnostics);
}

/// The tree with all parentheses.
std::string tree(const Expression& expression, std::size_t index) {
  const Expression::Node& node = expression.nodes()[index];
  switch (node.operation) {
    case Operation::number: {
      std::string text = std::to_string(node.number);
      text.erase(text.find_last_not_of('0') + 1);
      if (text.back() == '.') text.pop_back();
      return text + (node.unit ? "[" + node.unit->symbol + "]" : "");
    }
    case Operation::truth:
      return node.number == 1.0 ? "true" : "false";
    case Operation::name:
      return node.word.text;
    case Operation::quoted:
      return "'" + node.word.text + "'";
    default: {
      std::string text = node.operation == Operation::call ? node.word.text : to_string(node.operation);
      text += "(";
      for (const std::uint32_t part : node.parts)
        text += (text.back() == '(' ? "" : " ") + tree(expression, part);
      return text + ")";
    }
  }
}

std::string tree(const std::string& written) {
  Diagnostics diagnostics;
  const auto expression = parse("\"" + written + "\"", diagnostics);
  if (!expression) return diagnostics.to_text();
  return tree(*expression, expression->nodes().size() - 1);
}

TEST(Expression, JoinsOperationsByPrecedence) {
  EXPECT_EQ(tree("a == 1 or a == 9 and not b"), "or(==(a 1) and(==(a 9) not(b)))");
  EXPECT_EQ(tree("(a or b) and c"), "and(or(a b) c)");
  EXPECT_EQ(tree("a - b - c * d / e"), "-(-(a b) /(*(c d) e))");
  EXPECT_EQ(tree("-a ^ 2 + b"), "+(-(^(a 2)) b)");
  EXPECT_EQ(tree("2 ^ -1"), "^(2 -(1))");
  EXPECT_EQ(tree("a + 1 < b * 2"), "<(+(a 1) *(b 2))");
  EXPECT_EQ(tree("not not a == 1"), "not(not(==(a 1)))");
  EXPECT_EQ(tree("if a > 1 then b else c + 1"), "if(>(a 1) b +(c 1))");
  EXPECT_EQ(tree("if a then if b then c else d else e"), "if(a if(b c d) e)");
  EXPECT_EQ(tree("max(a, b + 1, -2) * (if c then 1 else 0)"), "*(max(a +(b 1) -(2)) if(c 1 0))");
  EXPECT_EQ(tree("f()"), "f()");
  EXPECT_EQ(tree("can.x.Y == 'limp home' or true"), "or(==(can.x.Y 'limp home') true)");
}

TEST(Expression, ReadsUnitsAfterNumbers) {
  EXPECT_EQ(tree("v > 50 km/h"), ">(v 50[km/h])");
  EXPECT_EQ(tree("v > 50km/h and w"), "and(>(v 50[km/h]) w)");
  EXPECT_EQ(tree("3 N m + 2 kg m2/s2"), "+(3[N m] 2[kg m2/s2])");
  EXPECT_EQ(tree("10 m / t"), "/(10[m] t)");
  EXPECT_EQ(tree("10 m / 2 s"), "/(10[m] 2[s])");
  EXPECT_EQ(tree("10 m * t"), "*(10[m] t)");
  EXPECT_EQ(tree("5 % * x"), "*(5[%] x)");
  EXPECT_EQ(tree("2 * x"), "*(2 x)");
  EXPECT_EQ(tree("3 m s^-1"), "3[m s^-1]");
  EXPECT_EQ(tree("20 \u00b0C"), "20[\u00b0C]");
  EXPECT_EQ(tree("min(5 min, 2 h)"), "min(5[min] 2[h])");
  EXPECT_EQ(tree("(3 m)^2"), "^(3[m] 2)");
}

TEST(Expression, KeepsThePlaceOfEachPart) {
  Diagnostics diagnostics;
  const auto expression = parse(">\n  a > 1\n  and bb < 2\n", diagnostics);
  ASSERT_TRUE(expression) << diagnostics.to_text();
  std::vector<Place> names;
  for (const Expression::Node& node : expression->nodes())
    if (node.operation == Operation::name) names.push_back(node.word.place);
  EXPECT_EQ(names, (std::vector<Place>{{"f.yaml", 2, 3}, {"f.yaml", 3, 7}}));
  EXPECT_EQ(expression->text(), "a > 1 and bb < 2\n");
}

TEST(Expression, MistakesHaveTheirPlace) {
  const std::tuple<const char*, std::uint32_t, const char*> mistakes[] = {
      {"a >", 11, "the expression ends where a signal or a number is expected"},
      {"a == 1 && b == 2", 15, "found '&'; write and"},
      {"\"a == 1 || b == 2\"", 16, "write or"},
      {"\"! a == 1\"", 9, "expected a signal or a number, found '!'; write not"},
      {"a = 1", 10, "write =="},
      {"a ** 2", 11, "expected a signal or a number, found '*'"},
      {"a ? 1", 10, "write if ... then ... else"},
      {"1 < a < 2", 14, "can not be chained"},
      {"a.b == 'open", 15, "not closed"},
      {"a > 50 furlongs", 15, "'furlongs' is not a unit"},
      {"a > 2 m/x", 14, "'m/x' is not a unit; to divide or multiply the number, write blanks"},
      {"(a > 1", 14, "the expression ends where an operation or ')'"},
      {"a > 1)", 13, "found ')'"},
      {"a b", 10,
       "expected an operation or the end of the expression, found 'b'; write a value name of several words "
       "in "
       "quotes, as \"'a b'\""},
      {"m == KL15 on  2 > 3", 18,
       "expected an operation or the end of the expression, found 'on'; write a value name of several words "
       "in quotes, as \"'KL15 on  2'\""},
      {"(a) b", 12, "expected an operation or the end of the expression, found 'b'"},
      {"a > 010", 12, "leading zero"},
      {"a > 1e400", 12, "too large"},
      {"a..b > 1", 8, "'a..b' is not a signal's name"},
      {"a > and", 12, "found 'and'"},
      {"a > $", 12, "found '$'"},
      {"if a then b", 19, "the expression ends where an operation or 'else'"},
      {"if a else b", 13, "expected an operation or 'then', found 'else'"},
      {"1 + if a then b else c", 12, "'if' inside an operation needs parentheses"},
      {"a else b", 10, "expected an operation or the end of the expression, found 'else'"},
      {"f(a; b)", 11, "expected an operation or ',' or ')', found ';'"},
      {"f(a,)", 12, "expected a signal or a number, found ')'"},
  };
  for (const auto& [written, column, words] : mistakes) {
    Diagnostics diagnostics;
    EXPECT_FALSE(parse(written, diagnostics)) << written;
    EXPECT_TRUE(is_only_mistake(diagnostics, 1, column, words)) << written;
  }
}

TEST(Expression, LimitsAreExact) {
  const auto nested = [](std::size_t levels) {
    return std::string(levels, '(') + "a" + std::string(levels, ')');
  };
  Diagnostics none;
  EXPECT_TRUE(parse(nested(Expression::max_nesting), none));
  Diagnostics deep;
  EXPECT_FALSE(parse(nested(Expression::max_nesting + 1), deep));
  EXPECT_TRUE(is_only_mistake(deep, 1, 8 + Expression::max_nesting, "nested deeper than 32"));
  std::string largest = "a";  // one node, and two more for each sum
  for (std::size_t nodes = 1; nodes + 2 <= Expression::max_nodes; nodes += 2)
    largest += "+a";
  EXPECT_TRUE(parse(largest, none)) << none.to_text();
  Diagnostics many;
  EXPECT_FALSE(parse(largest + "+a", many));
  EXPECT_NE(many.to_text().find("more than 1024 operands and operations"), std::string::npos);
  Diagnostics long_text;
  EXPECT_FALSE(parse("a + " + std::string(Expression::max_text_bytes, ' ') + "b", long_text));
  EXPECT_TRUE(is_only_mistake(long_text, 1, 8, "at most 8192 bytes"));
}

}  // namespace
}  // namespace hil::config
