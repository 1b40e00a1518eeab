// What a comparison says when it has nothing to show. What it shows is held to the closed form by
// figure8_test.

#include "runtime/modules/laser_scanner/sweep_comparison.hpp"

#include <gtest/gtest.h>

namespace hil::modules {
namespace {

constexpr std::int64_t second_ns = 1'000'000'000;

class Comparison : public ::testing::Test {
 protected:
  void sweep(int hits) {
    const std::vector<std::optional<BodyMotion>> motion{BodyMotion{.center = {{20.0, 0.0}, {0.0, 5.0}}}};
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
  report::RunRecord record() const {
    report::RunRecord record;
    record.top_view.emplace().time_ns = 7 * second_ns;
    comparison_.contribute(record);
    return record;
  }

  const ScanPattern pattern_{
      {.columns = 100, .rows = 10, .horizontal_rad = 1.0, .vertical_rad = 0.5, .period_ns = second_ns}};
  SweepComparison comparison_{
      pattern_,
      {{.name = "traffic.van", .entity = {.index = 3, .generation = 1}, .length_m = 4.5, .width_m = 1.8}}};
};

TEST_F(Comparison, ABodyThatWasNeverWhollyInViewIsNamed) {
  sweep(5);
  const report::RunRecord said = record();
  EXPECT_TRUE(said.scan_comparison.empty());
  ASSERT_EQ(said.events.size(), 1U);
  EXPECT_EQ(said.events[0].text, "no length of traffic.van is compared: no whole sweep saw its whole side");
  EXPECT_EQ(said.events[0].time_ns, 7 * second_ns);
}

TEST_F(Comparison, MorePointsThanItKeepsAreSaid) {
  sweep((1 << 15) + 1);
  const report::RunRecord said = record();
  EXPECT_TRUE(said.scan_comparison.empty());
  ASSERT_EQ(said.events.size(), 1U);
  EXPECT_EQ(said.events[0].text,
            "no length of traffic.van is compared: a sweep had more than 32768 points of it");
}

}  // namespace
}  // namespace hil::modules
