// Runs with too little memory, too few file descriptors or too small files. Each ends with its exit code and
// a report; no run is ended by a signal, and no text blames the scenario.

#include <gtest/gtest.h>

#include "tests/support/rounds.hpp"
#include "tests/system/scenario/hil.hpp"
#include "tests/system/scenario/run_files.hpp"

namespace hil::scenario_test {
namespace {

/// The words of a command that runs within `ulimit OPTION VALUE`.
std::vector<std::string> within(const char* option, std::uint64_t value,
                                const std::vector<std::string>& words) {
  const std::string shell =
      "ulimit " + std::string(option) + " " + std::to_string(value) + " && exec \"$0\" \"$@\"";
  return joined({{"bash", "-c", shell}, words});
}

std::size_t lines_of_hil(const std::string& errors) {
  std::size_t count = 0;
  for (std::size_t at = errors.find("hil run: "); at != std::string::npos;
       at = errors.find("hil run: ", at + 1))
    ++count;
  return count;
}

/// Runs the crossing for a short time within the limit. Returns whether it ran; otherwise it has to end with
/// code 4 or 70, one sentence that names the limit, and a report with this code.
bool runs_within(const char* option, std::uint64_t value) {
  SCOPED_TRACE(std::string("ulimit ") + option + " " + std::to_string(value));
  const Folder folder;
  const Ended ended =
      Program(within(option, value,
                     hil(joined({{"run", crossing(), "--duration", "0.2s", "--out", folder / "out"},
                                 few_beams(),
                                 relaxed_timing()}))))
          .wait();
  if (ended.code == 0 || ended.code == 1) {  // a run this short has too few answers
    EXPECT_GT(read_report(folder / "out")["ticks"], 0);
    return true;
  }
  EXPECT_TRUE(ended.code == 4 || ended.code == 70) << ended.code << ended.output << ended.errors;
  EXPECT_EQ(lines_of_hil(ended.errors), 1U) << ended.errors;
  EXPECT_NE(ended.errors.find(std::string("ulimit ") + option), std::string::npos) << ended.errors;
  EXPECT_EQ(ended.output.find("ulimit"), std::string::npos) << "the reason is printed once: " << ended.output;
  const auto report = read_report(folder / "out");
  EXPECT_EQ(report["exit_code"], ended.code);
  EXPECT_EQ(report["ticks"], 0);
  EXPECT_NE(report["reason"].get<std::string>().find(std::string("ulimit ") + option), std::string::npos);
  EXPECT_NE(read_text(folder / "out/junit.xml").find("<error "), std::string::npos);
  return false;
}

const std::uint64_t memory_step_kib = tests::is_long() ? 7'000 : 290'000;
const std::uint64_t descriptor_step = tests::is_long() ? 1 : 37;

constexpr std::uint64_t min_memory_kib = 40'000;  // with less the program's libraries do not load
constexpr std::uint64_t enough_memory_kib = 8'000'000;

TEST(Limits, OfAddressSpaceEndRunsWithAReport) {
  for (std::uint64_t kib = min_memory_kib; kib < 1'500'000; kib += memory_step_kib)
    runs_within("-v", kib);
  EXPECT_FALSE(runs_within("-v", 300'000));
  EXPECT_TRUE(runs_within("-v", enough_memory_kib));
}

TEST(Limits, OfDataEndRunsWithAReport) {
  for (std::uint64_t kib = 5'000; kib < 600'000; kib += memory_step_kib)
    runs_within("-d", kib);
  EXPECT_FALSE(runs_within("-d", 100'000));
  EXPECT_TRUE(runs_within("-d", enough_memory_kib));
}

TEST(Limits, OfDescriptorsEndRunsWithAReport) {
  for (std::uint64_t count = 9; count < 120; count += descriptor_step)
    runs_within("-n", count);
  EXPECT_FALSE(runs_within("-n", 24));
  EXPECT_TRUE(runs_within("-n", 256));
}

TEST(Limits, OfDescriptorsAreRaisedIfSoft) {
  EXPECT_TRUE(runs_within("-S -n", 24));
}

TEST(Limits, OfFileSizesEndRunsWithAReport) {
  for (const std::uint64_t kib : {100, 1000})
    EXPECT_FALSE(runs_within("-f", kib));
}

/// The log of the database and report.html are too large; the files for a CI system are smaller.
TEST(Limits, OfFileSizesPermitSmallReports) {
  const Folder folder;
  const Ended ended =
      Program(within("-f", 8, hil(joined({{"run", crossing(), "--out", folder / "out"}, few_beams()}))))
          .wait();
  EXPECT_EQ(ended.code, 4) << ended.output << ended.errors;
  EXPECT_EQ(read_report(folder / "out")["exit_code"], 4);
  EXPECT_NE(read_text(folder / "out/junit.xml").find("<error "), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(folder / "out/report.html"));
}

TEST(Limits, DoNotPreventInterrupts) {
  for (const int number : {SIGINT, SIGTERM}) {
    const Folder folder;
    Program run(
        within("-v", enough_memory_kib,
               hil(joined({{"run", crossing(), "--out", folder / "out"}, few_beams(), relaxed_timing()}))));
    ASSERT_TRUE(run_begins(run, folder / "out"));
    run.signal(number);
    const Ended ended = run.wait();
    EXPECT_EQ(ended.code, 130) << ended.output << ended.errors;
    EXPECT_EQ(read_report(folder / "out")["exit_code"], 130);
  }
}

/// Where the driver of the GPU reports the lack of memory itself, the database does not open (code 5).
TEST(Limits, DoctorReportsThatMemoryRanOut) {
  std::size_t reported = 0;
  for (std::uint64_t kib = 100'000; kib <= 400'000; kib += 50'000) {  // too little for a Vulkan device
    const Ended ended = Program(within("-v", kib, hil({"doctor"}))).wait();
    SCOPED_TRACE("ulimit -v " + std::to_string(kib));
    ASSERT_TRUE(ended.code == 70 || ended.code == 5) << ended.code << ended.output << ended.errors;
    if (ended.code == 5) continue;
    EXPECT_NE(ended.errors.find("hil doctor: memory ran out: "), std::string::npos) << ended.errors;
    ++reported;
  }
  EXPECT_GT(reported, 0U);
}

}  // namespace
}  // namespace hil::scenario_test
