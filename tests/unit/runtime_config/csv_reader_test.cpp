// Rows of CSV files, and files that are refused.

#include "runtime/config/csv_reader.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace hil::config {
namespace {

class CsvReaders : public ::testing::Test {
 protected:
  /// The cells of all rows: "a|b/1|2".
  std::string rows_of(const std::string& text) {
    diagnostics_ = {};
    CsvReader file(folder_.write("f.csv", text), {"s.yaml", 1, 1}, diagnostics_);
    std::string rows;
    while (file.next()) {
      if (!rows.empty()) rows += "/";
      for (std::size_t i = 0; i < file.columns(); ++i)
        rows += (i == 0 ? "" : "|") + std::string(file.cell(i));
    }
    return rows;
  }
  std::string mistakes() const {
    const std::string text = diagnostics_.to_text();
    const std::size_t name = text.find("f.csv");
    return name == std::string::npos ? text : text.substr(name);
  }

  const tests::TemporaryFolder folder_;
  Diagnostics diagnostics_;
};

TEST_F(CsvReaders, DivideRowsIntoCells) {
  EXPECT_EQ(rows_of("a,b\n1,2\n"), "a|b/1|2");
  EXPECT_EQ(rows_of("a , b\r\n\r\n# note, of a tool\n 1,\t2\r\n,"), "a|b/1|2/|");
  EXPECT_EQ(rows_of("\xef\xbb\xbftime,x\n0,1"), "time|x/0|1") << "a byte order mark";
  EXPECT_EQ(rows_of("a\n\xef\xbb\xbf"), "a/\xef\xbb\xbf") << "in the first line alone";
  EXPECT_EQ(rows_of(""), "");
  EXPECT_EQ(mistakes(), "");
}

TEST_F(CsvReaders, EndAtARowOfAnotherLength) {
  EXPECT_EQ(rows_of("a,b\n1,2\n\n3\n4,5\n"), "a|b/1|2");
  EXPECT_EQ(mistakes(), "f.csv:4:1: the row has 1 cell and the file 2 columns; give each column a cell\n");
  EXPECT_EQ(rows_of("a,b\n1,5,2\n"), "a|b");
  EXPECT_EQ(
      mistakes(),
      "f.csv:2:1: the row has 3 cells and the file 2 columns; put a cell with a comma in quotes, and write "
      "0.5, not 0,5\n");
  EXPECT_EQ(rows_of("a;b\n1;5;2\n"), "a|b");
  EXPECT_EQ(mistakes(),
            "f.csv:2:1: the row has 3 cells and the file 2 columns; put a cell with a semicolon in quotes\n");
}

TEST_F(CsvReaders, ExplainCommasInAFileOfOneColumn) {
  EXPECT_EQ(rows_of("a\n1,5\n"), "a");
  EXPECT_EQ(
      mistakes(),
      "f.csv:2:1: the row has 2 cells and the file 1 column; put a cell with a comma in quotes, and write "
      "0.5, not 0,5\n");
}

TEST_F(CsvReaders, TakeNumbersWithAPlus) {
  const auto number_in = [&](const std::string& text) {
    diagnostics_ = {};
    CsvReader file(folder_.write("f.csv", "x,y\n" + text + ",0\n"), {"s.yaml", 1, 1}, diagnostics_);
    EXPECT_TRUE(file.next() && file.next());
    return file.number(0);
  };
  std::mt19937_64 random(74'150);
  for (int i = 0; i < 200; ++i) {
    const double value =
        std::ldexp(static_cast<double>(random() >> 11U), static_cast<int>(random() % 80) - 90);
    char text[40];
    std::snprintf(text, sizeof text, "%+.17E", value);
    ASSERT_EQ(number_in(text), value) << text;
    ASSERT_EQ(number_in(text + 1), value) << text;
  }
  EXPECT_EQ(number_in("+.5"), 0.5);
  EXPECT_EQ(number_in("\"+1.000000E-03\""), 0.001);
  for (const char* const wrong : {"+", "+-1", "-+1", "++1", "+x", "+ 1", "+inf", "+nan"}) {
    EXPECT_EQ(number_in(wrong), std::nullopt) << wrong;
    EXPECT_NE(mistakes().find("is not a number"), std::string::npos) << wrong << ": " << mistakes();
  }
  EXPECT_EQ(number_in("\"+0,5\""), std::nullopt);
  EXPECT_NE(mistakes().find("has a decimal comma; write 0.5"), std::string::npos) << mistakes();
}

TEST_F(CsvReaders, RefuseTabsBetweenCellsByThatName) {
  const std::string tabs = "the cells are separated by tabs; separate them by ',' or ';'";
  for (const char* const text :
       {"time\tu\n0\t1\n", "time \t u\n0 \t 1\n", "0\t1\n1\t2\n", "\"time\"\t\"u\"\n0\t1\n",
        "sep=\t\ntime\tu\n", "# of a tool\ntime\tu\r\n0\t1\r\n", "time\tu, in V\n0\t1\n"}) {
    EXPECT_EQ(rows_of(text), "") << text;
    EXPECT_NE(mistakes().find(tabs), std::string::npos) << text << ": " << mistakes();
  }
  EXPECT_EQ(rows_of("time,u\n0\t1\n"), "time|u");
  EXPECT_NE(mistakes().find("f.csv:2:1: " + tabs), std::string::npos) << mistakes();
  EXPECT_EQ(rows_of("time,\tu\n0\t,1\n\"a\tb\",2\n"), "time|u/0|1/a\tb|2") << "blanks, and a quoted one";
  EXPECT_EQ(mistakes(), "");
}

TEST_F(CsvReaders, FindTheSeparatorInTheFirstRow) {
  EXPECT_EQ(rows_of("a;b\n1;2,5\n"), "a|b/1|2,5");
  EXPECT_EQ(rows_of("# note; of a tool\n\na,b\n1;2,3\n"), "a|b/1;2|3") << "a comment is no row";
  EXPECT_EQ(rows_of("\xef\xbb\xbf;x,y\n1;2"), "|x,y/1|2") << "the first one decides";
  EXPECT_EQ(rows_of("\"a;b\",c;d\n1,2\n"), "a;b|c;d/1|2") << "outside of quotes";
  EXPECT_EQ(rows_of("a\n1;2\n"), "a/1;2") << "one column";
  EXPECT_EQ(mistakes(), "");
}

TEST_F(CsvReaders, TakeTheSeparatorOfTheFirstLine) {
  EXPECT_EQ(rows_of("sep=;\r\na,x;b\r\n1;2\r\n"), "a,x|b/1|2");
  EXPECT_EQ(rows_of("\xef\xbb\xbfsep=,\na;x,b\n1,2\n"), "a;x|b/1|2");
  EXPECT_EQ(rows_of("a,b\nsep=,1\n"), "a|b/sep=|1") << "in the first line alone";
  EXPECT_EQ(mistakes(), "");
  EXPECT_EQ(rows_of("sep=|\na|b\n"), "");
  EXPECT_EQ(mistakes(), "f.csv:1:1: cells are separated by ',' or ';', not by '|'\n");
}

TEST_F(CsvReaders, NameTheSeparatorsOfAHeaderAndARowThatDiffer) {
  EXPECT_EQ(rows_of("a;b\n0,1\n"), "a|b");
  EXPECT_EQ(mistakes(),
            "f.csv:2:1: the row has 1 cell and the file 2 columns; the separator of the header is ';', and "
            "this row has "
            "','\n");
  EXPECT_EQ(rows_of("a,b\n\"0,1\";2\n"), "a|b");
  EXPECT_NE(mistakes().find("text follows the closing quote"), std::string::npos) << mistakes();
  EXPECT_EQ(rows_of("a;b\n\"0,1\"\n"), "a|b");
  EXPECT_EQ(mistakes(), "f.csv:2:1: the row has 1 cell and the file 2 columns; give each column a cell\n")
      << "in quotes";
}

TEST_F(CsvReaders, RefuseANameOfTwoColumns) {
  CsvReader file(folder_.write("t.csv", "time;level;level\n"), {"s.yaml", 1, 1}, diagnostics_);
  ASSERT_TRUE(file.next());
  EXPECT_EQ(file.find_column("time", {}), 0U);
  EXPECT_EQ(file.find_column("level", {}), std::nullopt);
  ASSERT_EQ(diagnostics_.count(), 1U);
  EXPECT_EQ(diagnostics_.mistakes()[0].message, "there are two columns 'level'");
  EXPECT_EQ(diagnostics_.mistakes()[0].place.column, 12U);
}

TEST_F(CsvReaders, ReadCellsInQuotes) {
  EXPECT_EQ(rows_of("a,b\n\"1, 2\" , \t\" x \"\r\n"), "a|b/1, 2| x ");
  EXPECT_EQ(rows_of("\"a\";\"b;c\"\n\"\";\"say \"\"no\"\"\"\n"), "a|b;c/|say \"no\"");
  EXPECT_EQ(rows_of("a,b\n\"#1\",2\n5\" pipe,\"\"\"\""), "a|b/#1|2/5\" pipe|\"")
      << "a quote at the begin of a cell alone is one around it";
  EXPECT_EQ(rows_of("a\n\"\"\n"), "a/") << "an empty cell, not a line without text";
  EXPECT_EQ(mistakes(), "");
  CsvReader file(folder_.write("n.csv", "a;b\n \"4\"\"\" ; \"x\"\n"), {"s.yaml", 1, 1}, diagnostics_);
  ASSERT_TRUE(file.next() && file.next());
  EXPECT_EQ(file.place(0).column, 3U);
  EXPECT_EQ(file.place(1).column, 11U) << "behind the quote";
}

TEST_F(CsvReaders, RefuseQuotesThatDoNotEnclose) {
  EXPECT_EQ(rows_of("a,b\n1,\"2\n3\",4\n"), "a|b");
  EXPECT_EQ(mistakes(), "f.csv:2:3: the quote of this cell does not close in its line; close it there\n");
  EXPECT_EQ(rows_of("a,b\n1,\"2\"\"\n"), "a|b");
  EXPECT_EQ(mistakes(), "f.csv:2:3: the quote of this cell does not close in its line; close it there\n");
  EXPECT_EQ(rows_of("a,b\n\"1\" 2,3\n"), "a|b");
  EXPECT_EQ(mistakes(), "f.csv:2:4: text follows the closing quote; write a quote inside a cell twice\n");
}

TEST_F(CsvReaders, RefuseTooManyColumns) {
  std::string row = "0";
  for (std::size_t i = 1; i < max_csv_columns; ++i)
    row += ",0";
  rows_of(row);
  EXPECT_EQ(mistakes(), "");
  EXPECT_EQ(rows_of(row + ",0"), "");
  EXPECT_EQ(mistakes(), "f.csv:1:1: the row has more cells than the limit of 10000; split the file\n");
}

TEST_F(CsvReaders, RefuseTooManyBytes) {
  EXPECT_EQ(rows_of("a\n" + std::string(max_csv_bytes, ' ')), "");
  EXPECT_EQ(mistakes(),
            "s.yaml:1:1: the file has 67108866 bytes, more than the limit of 67108864; split it\n");
}

TEST_F(CsvReaders, ReportThatAFileCanNotBeRead) {
  CsvReader folder(folder_.path().string(), {"s.yaml", 1, 1}, diagnostics_);
  EXPECT_FALSE(folder.next()) << "a read of a folder fails after it is open";
  EXPECT_EQ(mistakes(), "s.yaml:1:1: the file can not be read after its line 0\n");
  diagnostics_ = {};
  CsvReader missing((folder_.path() / "none.csv").string(), {"s.yaml", 1, 1}, diagnostics_);
  EXPECT_FALSE(missing.next());
  ASSERT_EQ(diagnostics_.count(), 1U);
  EXPECT_NE(mistakes().find("none.csv' can not be opened"), std::string::npos) << mistakes();
}

TEST_F(CsvReaders, SayWhatToWriteForADecimalComma) {
  CsvReader file(folder_.write("c.csv", "a;b;c;d;e;f\n0,5;-12,25;+1,5;1.000,5;1,000.5;1,2,3"),
                 {"s.yaml", 1, 1}, diagnostics_);
  ASSERT_TRUE(file.next() && file.next());
  for (std::size_t i = 0; i < file.columns(); ++i)
    EXPECT_EQ(file.number(i), std::nullopt) << i;
  const auto& all = diagnostics_.mistakes();
  ASSERT_EQ(all.size(), 6U);
  EXPECT_EQ(all[0].message, "'0,5' has a decimal comma; write 0.5");
  EXPECT_EQ(all[1].message, "'-12,25' has a decimal comma; write -12.25");
  EXPECT_EQ(all[2].message, "'+1,5' has a decimal comma; write 1.5");
  for (std::size_t i = 3; i < all.size(); ++i)
    EXPECT_NE(all[i].message.find("is not a number"), std::string::npos) << all[i].message;
  CsvReader numbers(folder_.write("d.csv", "1;2,5"), {"s.yaml", 1, 1}, diagnostics_);
  ASSERT_TRUE(numbers.next());
  EXPECT_TRUE(numbers.has_only_numbers()) << "no row of names";
}

TEST_F(CsvReaders, ReadNumbersWithADecimalPoint) {
  CsvReader file(folder_.write("n.csv", "1,-2.5e3, ,  x,inf,1e999,0x1,1 000"), {"s.yaml", 1, 1},
                 diagnostics_);
  ASSERT_TRUE(file.next());
  EXPECT_EQ(file.number(0), 1.0);
  EXPECT_EQ(file.number(1), -2500.0);
  for (std::size_t i = 2; i < file.columns(); ++i)
    EXPECT_EQ(file.number(i), std::nullopt) << i;
  const auto& all = diagnostics_.mistakes();
  ASSERT_EQ(all.size(), 6U);
  EXPECT_EQ(all[0].message, "an empty cell: a number is missing");
  EXPECT_EQ(all[0].place.column, 10U);
  EXPECT_EQ(all[1].message, "'x' is not a number");
  EXPECT_EQ(all[1].place.column, 14U) << "behind its blanks";
  EXPECT_EQ(all[5].message, "'1 000' is not a number");
}

}  // namespace
}  // namespace hil::config
