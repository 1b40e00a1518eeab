// Tables, and the order of definitions.

#include "runtime/expression/table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/config/parse.hpp"
#include "runtime/expression/definition_order.hpp"

namespace hil::expression {
namespace {

Table table_of(const std::string& yaml) {
  config::Diagnostics diagnostics;
  const auto value = config::parse_text("t", yaml, Table::schema(), diagnostics);
  const auto table = value ? Table::read(*value, diagnostics) : std::nullopt;
  if (!table) throw std::runtime_error(diagnostics.to_text());
  return *table;
}

TEST(Table, IsLinearBetweenItsPoints) {
  const Table table = table_of("{x: {points: [0, 1, 4]}, values: [2, 4, 1]}");
  EXPECT_EQ(table.at(0.0), 2.0);
  EXPECT_EQ(table.at(0.25), 2.5);
  EXPECT_EQ(table.at(1.0), 4.0);
  EXPECT_EQ(table.at(3.0), 2.0);
  EXPECT_EQ(table.at(4.0), 1.0);
  EXPECT_TRUE(std::isnan(table.at(std::nan(""))));
}

TEST(Table, HasAValueOutsideItsPointsAsItIsWritten) {
  const std::string points = "x: {points: [0, 1, 2]}, values: [0, 1, 4]";
  const Table hold = table_of("{" + points + "}"), extend = table_of("{" + points + ", outside: extend}"),
              nowhere = table_of("{" + points + ", outside: unknown}");
  EXPECT_EQ(hold.at(-1.0), 0.0);
  EXPECT_EQ(hold.at(5.0), 4.0);
  EXPECT_EQ(hold.at(INFINITY), 4.0);
  EXPECT_EQ(extend.at(-1.0), -1.0);
  EXPECT_EQ(extend.at(3.0), 7.0);
  EXPECT_TRUE(std::isnan(nowhere.at(-1e-9)));
  EXPECT_EQ(nowhere.at(0.0), 0.0);
  EXPECT_EQ(nowhere.at(2.0), 4.0);
  EXPECT_TRUE(std::isnan(nowhere.at(2.000001)));
}

TEST(Table, KeepsTheValueOfThePointBelow) {
  const Table table = table_of("{x: {points: [0, 1, 2]}, values: [5, 6, 7], between: previous}");
  EXPECT_EQ(table.at(-1.0), 5.0);
  EXPECT_EQ(table.at(0.999), 5.0);
  EXPECT_EQ(table.at(1.0), 6.0);
  EXPECT_EQ(table.at(1.999), 6.0);
  EXPECT_EQ(table.at(2.0), 7.0);
  EXPECT_EQ(table.at(9.0), 7.0);
}

TEST(Table, OfTwoArgumentsIsLinearInEach) {
  const Table table =
      table_of("{x: {points: [0, 2]}, y: {points: [0, 1, 3]}, rows: [[0, 2], [10, 12], [30, 32]]}");
  for (const double x : {0.0, 0.7, 2.0})
    for (const double y : {0.0, 0.5, 1.0, 2.9, 3.0})
      EXPECT_NEAR(table.at(x, y), x + 10.0 * y, 1e-12) << x << " " << y;
  EXPECT_EQ(table.at(9.0, -9.0), 2.0);
  EXPECT_TRUE(std::isnan(table.at(1.0, std::nan(""))));
}

TEST(Table, IsInTheSi) {
  const Table table = table_of("{x: {unit: degC, points: [0, 100]}, values: [0, 3600], unit: 1/h}");
  EXPECT_NEAR(table.at(273.15), 0.0, 1e-12);
  EXPECT_NEAR(table.at(323.15), 0.5, 1e-12);
}

struct Order {
  std::string names, mistakes;
};
/// The names in their order, of lines "name: expression".
Order order_of(const std::string& yaml) {
  config::Diagnostics diagnostics;
  const auto value = config::parse_text("f", yaml, config::Schema::map(config::Schema::text()), diagnostics);
  std::vector<Definition> definitions;
  for (std::size_t i = 0; i < value->entries().size(); ++i) {
    const auto& [name, text] = value->entries()[i];
    definitions.push_back({{name, value->key_place(i)}, config::Expression::parse(text, diagnostics)});
  }
  Order order;
  for (const std::size_t i : definition_order(definitions, diagnostics))
    order.names += definitions[i].name.text;
  order.mistakes = diagnostics.to_text();
  return order;
}

TEST(DefinitionOrder, IsEachAfterThoseThatItReads) {
  EXPECT_EQ(order_of("{a: 1, b: 2, c: 3}").names, "abc");
  EXPECT_EQ(order_of("{a: b + c, b: c * other, c: max(d) + d, d: 4}").names, "dcba");
  EXPECT_EQ(order_of("{a: if b > 1 then c else d, b: d, c: 1, d: 2}").names, "dbca");
}

TEST(DefinitionOrder, LeavesOutCirclesWithOneMistakeEach) {
  const Order order = order_of("{a: b, b: c, c: b + d, d: e, e: e, f: 1, g: +}");
  EXPECT_EQ(order.names, "daf") << "a and d read one with a mistake, and are none themselves";
  EXPECT_EQ(order.mistakes,
            "f:1:8: b needs c needs b: a value can not be computed from itself\n"
            "f:1:30: e needs e: a value can not be computed from itself\n"
            "f:1:46: the expression ends where a signal or a number is expected\n");
}

TEST(DefinitionOrder, FollowsLongChains) {
  std::string chain = "{v0: 1", circle = "{v0: v19999";
  for (int i = 1; i < 20'000; ++i) {
    const std::string line = ", v" + std::to_string(i) + ": v" + std::to_string(i - 1);
    chain += line;
    circle += line;
  }
  EXPECT_EQ(order_of(chain + "}").mistakes, "");
  const Order order = order_of(circle + "}");
  EXPECT_EQ(order.names, "");
  EXPECT_NE(order.mistakes.find("needs ... needs v0"), std::string::npos) << order.mistakes.substr(0, 300);
  EXPECT_LT(order.mistakes.size(), 300U);
}

}  // namespace
}  // namespace hil::expression
