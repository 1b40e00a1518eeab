// The events of a comparison without a length, and its table. figure8_test compares measured lengths with the
// closed form.

#include <gtest/gtest.h>

#include "runtime/modules/laser_scanner/comparison_section.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

class LengthComparison : public ::testing::Test {
 protected:
  void sweep(int hits) {
    const std::vector<std::optional<ComparedMotion>> motion{
        ComparedMotion{.center = {{20.0, 0.0}, {0.0, 5.0}}}};
    comparison_.begin_sweep(0, {.point = {{0.0, 0.0}, {0.0, 0.0}}, .heading_rad = 0.0}, motion);
    rtstdb::RayHit hit;
    hit.entity = {.index = 3, .generation = 1};
    hit.lambda = 20.0f;
    hit.n_world = {-1.0f, 0.0f, 0.0f};
    for (int i = 0; i < hits; ++i) {
      comparison_.add_hit(hit, 10, 5, false);
      comparison_.add_hit(hit, 10, 5, true);
    }
    comparison_.end_sweep();
  }
  contribution::Contribution contributed() const {
    contribution::Contribution report;
    report.end_ns = 7 * second_ns;
    contribute_comparison(comparison_, report);
    return report;
  }

  const ScanPattern pattern_{
      {.columns = 100, .rows = 10, .horizontal_rad = 1.0, .vertical_rad = 0.5, .period_ns = second_ns}};
  SweepComparison comparison_{
      pattern_,
      {{.name = "traffic.van", .entity = {.index = 3, .generation = 1}, .length_m = 4.5, .width_m = 1.8}}};
};

TEST_F(LengthComparison, ReportsWhyALengthIsNotCompared) {
  const std::string begin = "the length of traffic.van is not compared: ";
  for (const auto& [hits, reason] : {std::pair(5, "no sweep saw its whole side"),
                                     {(1 << 15) + 1, "a sweep had more than 32768 points of it"}}) {
    sweep(hits);
    const contribution::Contribution report = contributed();
    EXPECT_TRUE(report.sections.empty());
    ASSERT_EQ(report.events.size(), 1U);
    EXPECT_EQ(report.events[0].text, begin + reason);
    EXPECT_EQ(report.events[0].time_ns, 7 * second_ns);
  }
}

TEST(LengthsTable, MarksLengthsByTheirTolerance) {
  const contribution::Table table = lengths_table(
      {{.title = "near", .true_m = 4.5, .measured_m = 4.5, .closed_form_m = 4.6, .tolerance_m = 0.11},
       {.title = "far", .true_m = 4.5, .measured_m = 4.5, .closed_form_m = 4.6, .tolerance_m = 0.09}});
  ASSERT_EQ(table.rows.size(), 2U);
  for (const auto& row : table.rows)
    ASSERT_EQ(row.size(), table.columns.size());
  EXPECT_EQ(table.rows[0].back().mark, contribution::Mark::good);
  EXPECT_EQ(table.rows[1].back().mark, contribution::Mark::bad);
  EXPECT_NEAR(table.rows[1][4].number, -0.1, 1e-12) << "measured less closed form";
}

}  // namespace
}  // namespace hil::modules
