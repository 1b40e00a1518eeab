// Stimuli from CSV files.

#include "runtime/signals/csv_profile.hpp"

#include <gtest/gtest.h>

#include <string>

#include "tests/support/temporary_folder.hpp"

namespace hil::signals {
namespace {

constexpr std::int64_t ms = 1'000'000;

class CsvProfiles : public ::testing::Test {
 protected:
  std::optional<CsvProfile> read(const std::string& text, const std::string& column = "level",
                                 bool is_linear = true) {
    diagnostics_ = {};
    const std::string path = folder_.write("p.csv", text);
    auto profile =
        CsvProfile::read(path, {"s.yaml", 3, 9}, {column, {"s.yaml", 3, 30}}, is_linear, diagnostics_);
    EXPECT_EQ(profile.has_value(), diagnostics_.empty()) << diagnostics_.to_text();
    mistakes_ = diagnostics_.to_text();
    const std::size_t folder = mistakes_.find(path);
    if (folder != std::string::npos) mistakes_ = "p.csv" + mistakes_.substr(folder + path.size());
    return profile;
  }

  const tests::TemporaryFolder folder_;
  config::Diagnostics diagnostics_;
  std::string mistakes_;
};

TEST_F(CsvProfiles, AreLinearBetweenTheirRows) {
  auto profile = read("time,level,other\n0,1,9\n0.01,3,9\n0.02,3,9\n");
  ASSERT_TRUE(profile) << mistakes_;
  EXPECT_EQ(profile->at(0), 1.0);
  EXPECT_EQ(profile->at(5 * ms), 2.0);
  EXPECT_EQ(profile->at(10 * ms), 3.0);
  EXPECT_EQ(profile->at(15 * ms), 3.0);
  EXPECT_EQ(profile->at(900 * ms), 3.0);
  profile->rewind();
  EXPECT_EQ(profile->at(5 * ms), 2.0);
  EXPECT_EQ(profile->end_ns(), 20 * ms);
}

TEST_F(CsvProfiles, KeepTheValueOfTheRowBefore) {
  auto profile = read("time_s,level\n1,1\n2,2\n", "level", false);
  ASSERT_TRUE(profile) << mistakes_;
  EXPECT_EQ(profile->at(0), 1.0) << "before the first row";
  EXPECT_EQ(profile->at(1'999 * ms), 1.0);
  EXPECT_EQ(profile->at(2'000 * ms), 2.0);
}

TEST_F(CsvProfiles, MayHaveCommentsBlanksAndWindowsLineEnds) {
  auto profile = read("# made by a tool\r\n\r\n time , level \r\n0 , 1\r\n1 ,\t-2e-1\r\n");
  ASSERT_TRUE(profile) << mistakes_;
  EXPECT_EQ(profile->at(1'000 * ms), -0.2);
}

TEST_F(CsvProfiles, ReportMistakesAtTheirPlaces) {
  const struct {
    std::string text, mistake;
  } all[] = {
      {"time,level\n0,1\n1,\n", "p.csv:3:3: an empty cell: a number is missing\n"},
      {"time,level\n0,1\n1,abc\n", "p.csv:3:3: 'abc' is not a number\n"},
      {"time,level\n0,1\n1,nan\n", "p.csv:3:3: 'nan' is not a number\n"},
      {"time,level\n0,1\n1,1 m\n", "p.csv:3:3: '1 m' is not a number\n"},
      {"time,level\n0,1\n0,2\n",
       "p.csv:3:1: times have to be strictly increasing, but this one is not after that of the row before\n"},
      {"time,level\n0,1\n1,2,3\n",
       "p.csv:3:1: the row has 3 cells and the file 2 columns; put a cell with a comma in quotes, and "
       "write 0.5, not 0,5\n"},
      {"time,levl\n0,1\n", "s.yaml:3:30: the file has no column 'level'; did you mean 'levl'?\n"},
      {"t,level\n0,1\n", "p.csv:1:1: the file has no column 'time'; known here: t, level\n"},
      {"time,level\n", "s.yaml:3:9: the file has no rows\n"},
      {"", "s.yaml:3:9: the file has no rows\n"},
      {"time,level\n1e10,1\n", "p.csv:2:1: a time beyond 1e9 s\n"},
  };
  for (const auto& one : all) {
    read(one.text);
    EXPECT_EQ(mistakes_, one.mistake) << one.text;
  }
}

}  // namespace
}  // namespace hil::signals
