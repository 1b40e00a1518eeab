// Rows of CSV files, and files that are refused.

#include "runtime/config/csv_reader.hpp"

#include <gtest/gtest.h>

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
  EXPECT_EQ(mistakes(), "f.csv:4:1: 1 cells in a file of 2 columns\n");
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
