#include "runtime/report/report_files.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <fstream>
#include <set>

#include "sample_record.hpp"
#include "strict_xml.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::report {
namespace {

namespace fs = std::filesystem;

class ReportFiles : public testing::Test {
 protected:
  std::string content(const std::string& name) const { return folder_.read(name); }

  const tests::TemporaryFolder folder_;
  const fs::path directory_ = folder_.path();
};

TEST_F(ReportFiles, AreAllWrittenCompletely) {
  write_report(test::full_record(), directory_ / "deep" / "er");
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(directory_ / "deep" / "er")) {
    if (entry.is_regular_file())
      names.insert(fs::relative(entry.path(), directory_ / "deep" / "er").generic_string());
  }
  EXPECT_EQ(names,
            (std::set<std::string>{"junit.xml", "pictures/scan-1.svg", "pictures/scan-2.svg",
                                   "pictures/scan-3.svg", "pictures/scan-4.svg", "pictures/signals-1.svg",
                                   "pictures/top-view.svg", "report.html", "report.json"}));
  EXPECT_EQ(test::parse_strictly(content("deep/er/pictures/top-view.svg")).attributes.at("xmlns"),
            "http://www.w3.org/2000/svg");
}

TEST_F(ReportFiles, AreRemadeFromTheJson) {
  write_report(test::full_record(), directory_);
  const std::string page = content("report.html");
  const std::string json = content("report.json");
  fs::remove(directory_ / "report.html");
  remake_report(load_report(directory_), directory_);
  EXPECT_EQ(content("report.json"), json);
  const std::string again = content("report.html");
  // Written points are rounded, so the pictures may differ by less than the width of a line.
  EXPECT_EQ(test::parse_strictly(again).whole_text(), test::parse_strictly(page).whole_text());
  remake_report(load_report(directory_), directory_);
  EXPECT_EQ(content("report.html"), again);
}

TEST_F(ReportFiles, OfAnEmptyRunHaveNoPictures) {
  write_report(RunRecord{}, directory_);
  EXPECT_FALSE(fs::exists(directory_ / "pictures"));
  EXPECT_TRUE(fs::exists(directory_ / "report.html"));
}

TEST_F(ReportFiles, IncludeTheTrace) {
  write_trace({"hil", {{"base"}}, {{0, 1, 2, 3, ""}}, {}}, directory_);
  EXPECT_EQ(nlohmann::json::parse(content("trace.json")).at("traceEvents").size(), 4U);
}

TEST_F(ReportFiles, ErrorsNameThePath) {
  const auto message = [](auto action) -> std::string {
    try {
      action();
    } catch (const ReportError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NE(message([&] {
              load_report(directory_);
            }).find((directory_ / "report.json").string() + " can not be read: No such file"),
            std::string::npos);
  std::ofstream(directory_ / "report.json") << "{}";
  EXPECT_EQ(message([&] { load_report(directory_); }),
            (directory_ / "report.json").string() + ": schema_version is missing");
  std::ofstream(directory_ / "file") << "x";
  EXPECT_NE(message([&] { write_report(RunRecord{}, directory_ / "file"); }).find("can not be created"),
            std::string::npos);
  fs::create_directories(directory_ / "taken" / "report.json");
  EXPECT_NE(message([&] {
              write_report(RunRecord{}, directory_ / "taken");
            }).find("report.json can not be written"),
            std::string::npos);
}

TEST_F(ReportFiles, OnAFullDiskAreAnError) {
  if (!fs::exists("/dev/full")) FAIL() << "this machine has no /dev/full";
  fs::create_symlink("/dev/full", directory_ / "report.json.part");
  EXPECT_THROW(write_report(test::full_record(), directory_), ReportError);
  EXPECT_FALSE(fs::exists(directory_ / "report.json"));
  EXPECT_FALSE(fs::is_symlink(directory_ / "report.json.part"))
      << "it would use space that the other files need";
}

}  // namespace
}  // namespace hil::report
