#include "runtime/run/fail_on.hpp"

#include <gtest/gtest.h>

namespace hil::run {
namespace {

bool broken(const std::string& text, const executive::RunResult& result,
            const report::RunRecord& record = {}) {
  config::Diagnostics diagnostics;
  const auto condition = parse_fail_on(text, diagnostics);
  if (!condition) throw std::runtime_error(diagnostics.to_text());
  return timing_broken(*condition, result, record);
}

executive::RunResult two_tasks() {
  executive::RunResult result;
  result.tasks.resize(2);
  return result;
}

TEST(FailOn, EveryCountHasItsSource) {
  const executive::RunResult clean = two_tasks();
  struct Case {
    const char* count;
    void (*change)(executive::RunResult&, report::RunRecord&);
  };
  const Case cases[] = {
      {"misses", [](auto& r, auto&) { r.tasks[1].deadline_misses = 3; }},
      {"overruns", [](auto& r, auto&) { r.tasks[1].overruns = 3; }},
      {"skipped", [](auto& r, auto&) { r.tasks[1].skipped = 3; }},
      {"aborted", [](auto& r, auto&) { r.tasks[1].aborted = 3; }},
      {"over_budget", [](auto& r, auto&) { r.tasks[1].over_budget = 3; }},
      {"skipped_ticks", [](auto& r, auto&) { r.base.skipped_ticks = 3; }},
      {"lost_records", [](auto& r, auto&) { r.lost_records = 3; }},
      {"hard_misses", [](auto&, auto& record) { record.transactions.hard_misses = 3; }},
      {"without_result", [](auto&, auto& record) { record.tasks[1].without_result = 3; }},
  };
  for (const Case& changed : cases) {
    executive::RunResult result = two_tasks();
    report::RunRecord record;
    record.tasks.resize(2);
    changed.change(result, record);
    for (const Case& compared : cases) {
      const std::string condition = std::string(compared.count) + " == 3";
      EXPECT_EQ(broken(condition, result, record), compared.count == changed.count)
          << compared.count << " with " << changed.count;
      EXPECT_FALSE(broken(condition, clean));
    }
  }
}

TEST(FailOn, CountsAreSumsOverAllTasks) {
  executive::RunResult result = two_tasks();
  result.tasks[0].deadline_misses = 2;
  result.tasks[1].deadline_misses = 5;
  EXPECT_TRUE(broken("misses == 7", result));
  EXPECT_FALSE(broken("misses > 7", result));
  EXPECT_TRUE(broken("misses", result)) << "not 0";
  EXPECT_FALSE(broken("overruns", result));
  EXPECT_TRUE(broken("misses == 7 or overruns > 0", result));
  EXPECT_FALSE(broken("misses == 7 and overruns > 0", result));
}

TEST(FailOn, UnknownCountIsAMistakeWithItsColumnAndAllCounts) {
  config::Diagnostics diagnostics;
  EXPECT_FALSE(parse_fail_on("misses > 0 or overuns > 0", diagnostics));
  EXPECT_EQ(
      diagnostics.to_text(),
      "--fail-on:1:15: 'overuns' is not a count of the run; did you mean 'overruns'? Known here: overruns, "
      "misses, skipped, aborted, over_budget, skipped_ticks, lost_records, hard_misses, without_result\n");
}

TEST(FailOn, WordThatIsNoConditionListsTheCounts) {
  for (const char* text : {"nonsense", "nonsense >", "misses > 0 or nonsense", "misses >> nonsense"}) {
    config::Diagnostics diagnostics;
    EXPECT_FALSE(parse_fail_on(text, diagnostics)) << text;
    EXPECT_NE(
        diagnostics.to_text().find("'nonsense' is not a count of the run; known here: misses, overruns, "
                                   "skipped, aborted, over_budget, skipped_ticks, lost_records, "
                                   "hard_misses, without_result"),
        std::string::npos)
        << diagnostics.to_text();
  }
}

TEST(FailOn, AllUnknownCountsAreReported) {
  config::Diagnostics diagnostics;
  EXPECT_FALSE(parse_fail_on("zebra > 0 or giraffe > 0", diagnostics));
  EXPECT_EQ(diagnostics.count(), 2U) << diagnostics.to_text();
}

TEST(FailOn, NumbersMayHaveAnExponent) {
  config::Diagnostics diagnostics;
  EXPECT_TRUE(parse_fail_on("misses > 1e3 and not (overruns < .5)", diagnostics)) << diagnostics.to_text();
}

TEST(FailOn, HostileTextIsRefused) {
  for (const char* text : {"", " ", ">", "misses >", "misses > > 0", "\"", "misses > 0 \"", "{a: b}",
                           "# misses > 0", "misses \x01> 0", "\xff\xfe", "5 > 3"}) {
    config::Diagnostics diagnostics;
    const auto condition = parse_fail_on(text, diagnostics);
    EXPECT_FALSE(condition) << text;
    EXPECT_FALSE(diagnostics.empty()) << text;
  }
}

}  // namespace
}  // namespace hil::run
