// Tables, and the order of definitions.

#include "runtime/expression/table.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "runtime/config/parse.hpp"
#include "runtime/expression/definition_order.hpp"
#include "tests/support/temporary_folder.hpp"

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

class TableFiles : public ::testing::Test {
 protected:
  Table table_from(const std::string& csv, const std::string& yaml) {
    const std::string file = folder_.write("t.yaml", yaml);
    folder_.write("p.csv", csv);
    const auto value = config::parse_file(file, Table::schema(), diagnostics_);
    const auto table = value ? Table::read(*value, diagnostics_) : std::nullopt;
    if (!table) throw std::runtime_error(diagnostics_.to_text());
    return *table;
  }
  /// The mistakes without the folder's name.
  std::string mistakes_of(const std::string& csv, const std::string& yaml) {
    diagnostics_ = {};
    try {
      table_from(csv, yaml);
      return "";
    } catch (const std::runtime_error& refusal) {
      std::string text = refusal.what();
      const std::string folder = folder_.path().string() + "/";
      for (std::size_t at = text.find(folder); at != std::string::npos; at = text.find(folder))
        text.erase(at, folder.size());
      return text;
    }
  }

  const tests::TemporaryFolder folder_;
  config::Diagnostics diagnostics_;
};

TEST_F(TableFiles, HaveAColumnForXAndOneForTheValues) {
  const std::string csv = "opening,flow\n0,0\n20,1\n100,6\n";
  const Table table = table_from(csv, "{file: p.csv, x: '%', unit: l/s}");
  EXPECT_EQ(table.axes().size(), 1U);
  EXPECT_NEAR(table.at(0.2), 1e-3, 1e-15);
  EXPECT_NEAR(table.at(0.6), 3.5e-3, 1e-15);
  const Table back = table_from("flow,note,opening\n0,5,1\n1,5,2\n",
                                "{file: {path: p.csv, x: opening, column: flow}, between: previous}");
  EXPECT_EQ(back.at(1.9), 0.0);
  EXPECT_EQ(back.at(2.0), 1.0);
}

TEST_F(TableFiles, OfTwoArgumentsAreAsTheyAreWrittenInYaml) {
  const Table file = table_from("speed/pedal,800,2000,6000\n0,0,0,0\n100,100,160,120\n",
                                "{file: p.csv, x: rpm, y: '%', unit: N m, outside: extend}");
  const Table lists = table_of(
      "{x: {unit: rpm, points: [800, 2000, 6000]}, y: {unit: '%', points: [0, 100]},"
      " rows: [[0, 0, 0], [100, 160, 120]], unit: N m, outside: extend}");
  for (const double x : {10.0, 100.0, 300.0, 900.0})
    for (const double y : {-0.5, 0.0, 0.3, 1.0, 2.0})
      EXPECT_EQ(file.at(x, y), lists.at(x, y)) << x << " " << y;
}

TEST_F(TableFiles, WithMistakesAreRefusedAtTheirLines) {
  const std::string one = "{file: p.csv}", two = "{file: p.csv, y: '1'}";
  const struct {
    std::string csv, yaml, mistake;
  } all[] = {
      {"x,v\n0,1\n2,1\n1,1\n", one,
       "p.csv:4:1: the points of a table have to be strictly increasing, but 1 is not above the point before "
       "it"},
      {"x,v\n0,1\n1,\n", one, "p.csv:3:3: an empty cell: a number is missing"},
      {"x,v\n0,1\n,1\n", one, "p.csv:3:1: an empty cell: a number is missing"},
      {"x,v\n0,1\n1,one\n", one, "p.csv:3:3: 'one' is not a number"},
      {"x,v\n0,1\n1,1e301\n", one, "p.csv:3:3: a number beyond 1e300"},
      {"x,v\n0,1\n1\n", one, "p.csv:3:1: the row has 1 cell and the file 2 columns; give each column a cell"},
      {"x,v\n0,1\n", one, "t.yaml:1:8: the file has 1 row with values; a table has at least 2"},
      {"0,1\n1,2\n2,3\n", one,
       "p.csv:1:1: the first row names the columns; this one has only numbers, so a row with names, "
       "as 'x,value', has to be before it"},
      {"", one, "t.yaml:1:8: the file has 0 rows with values; a table has at least 2"},
      {"x,v,w\n0,1,2\n1,1,2\n", one,
       "t.yaml:1:8: the file has 3 columns; 'column' has to name the one with the values"},
      {"x,flow\n0,1\n1,2\n", "{file: {path: p.csv, column: flaw}}",
       "t.yaml:1:30: the file has no column 'flaw'; did you mean 'flow'?"},
      {"x,flow\n0,1\n1,2\n", "{file: {path: p.csv, x: level}}",
       "t.yaml:1:25: the file has no column 'level'; known here: x, flow"},
      {"x,v\n0,1\n1,2\n", "{file: p.csv, x: {points: [0, 1]}}",
       "t.yaml:1:18: the points of 'x' are those of the file"},
      {"x,v\n0,1\n1,2\n", "{file: p.csv, x: metre}", "t.yaml:1:18: 'metre' is not a known unit"},
      {"", "{values: [0, 1], x: m}", "t.yaml:1:21: 'x' needs its 'points'"},
      {"", "{values: [0, 1]}", "t.yaml:1:1: 'x' needs its 'points'"},
      {"/,0,1\n0,1,2\n1,3\n", two,
       "p.csv:3:1: the row has 2 cells and the file 3 columns; give each column a cell"},
      {"/,0,0\n0,1,2\n1,3,4\n", two,
       "p.csv:1:5: the points of a table have to be strictly increasing, but 0 is not above the point before "
       "it"},
      {"/,0,1\n1,1,2\n0,3,4\n", two,
       "p.csv:3:1: the points of a table have to be strictly increasing, but 0 is not above the point before "
       "it"},
      {"/,0,1\n0,1,\n1,3,4\n", two, "p.csv:2:5: an empty cell: a number is missing"},
      {"/,0,b\n0,1,2\n1,3,4\n", two, "p.csv:1:5: 'b' is not a number"},
      {"/,0\n0,1\n1,3\n", two,
       "t.yaml:1:8: the file has 1 point of x in its first row; a table has at least 2"},
      {"/,0,1\n0,1,2\n", two, "t.yaml:1:8: the file has 1 row with values; a table has at least 2"},
      {"", two, "t.yaml:1:8: the file has 0 points of x in its first row; a table has at least 2"},
      {"/,0,1\n0,1,2\n1,1,2\n", "{file: {path: p.csv, column: v}, y: '1'}",
       "t.yaml:1:30: 'column' names a column of a table with one argument; this one has 'y'"},
  };
  for (const auto& one_of_all : all)
    EXPECT_EQ(mistakes_of(one_of_all.csv, one_of_all.yaml), one_of_all.mistake + "\n") << one_of_all.csv;
}

TEST_F(TableFiles, HaveLimits) {
  std::string column = "x,v\n", matrix = "/";
  for (int i = 0; i <= 100'000; ++i)
    column += std::to_string(i) + ",1\n";
  EXPECT_EQ(mistakes_of(column, "{file: p.csv}"),
            "p.csv:100002:1: the file has more points than the limit of 100000; use fewer\n");
  for (int i = 0; i < 1'001; ++i)
    matrix += "," + std::to_string(i);
  for (int row = 0; row < 1'000; ++row) {
    matrix += "\n" + std::to_string(row);
    for (int i = 0; i < 1'001; ++i)
      matrix += ",1";
  }
  EXPECT_EQ(mistakes_of(matrix, "{file: p.csv, y: '1'}"),
            "p.csv:1001:7: the file has more values than the limit of 1000000; use fewer points\n");
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
