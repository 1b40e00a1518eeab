// Batches of one transaction whose times are far apart.

#include "tests/gpu/database_fixture.hpp"

namespace rtstdb::test {
namespace {

class QueryWindows : public DatabaseTest {
 protected:
  void SetUp() override {
    DatabaseTest::SetUp();
    EntityRow row = row_of(add(make_box({2.0, 2.0, 2.0})), {0.0, 50.0, 0.0});
    row.motion.v_world_mps = {1.0, 0.0, 0.0};
    row.motion.valid_from = at_s(10.0);
    body_ = create(row, at_s(10.0));
  }
  static Ray down_at(float x, double t_s) { return ray_from({x, 50.0f, 10.0f}, {0, 0, -1}, at_s(t_s)); }

  EntityId body_;
};

/// The limit holds for each batch. A batch that ignores motion is at the version's time.
TEST_F(QueryWindows, AreSeparateForEachBatch) {
  const auto near = prepare_rays(RayMode::closest, false, 2);
  const auto far = prepare_rays(RayMode::closest, false, 2);
  const auto ignores_motion = prepare_rays(RayMode::closest, true, 2);
  const auto nearest = prepare(NearestQueryOptions{.name = "n", .capacity = 1});
  near->rays()[0] = down_at(0.0f, 10.0);
  far->rays()[0] = down_at(1000.0f, 1010.0);
  far->rays()[1] = down_at(1001.5f, 1011.0);
  ignores_motion->rays()[0] = down_at(0.0f, 1010.0);
  nearest->points()[0] = {.point_m = {500.0f, 50.0f, 10.0f}, .t = at_s(510.0)};
  for (int k = 0; k < 3; ++k) {
    const Outcome outcome = execute([&](Transaction& transaction) {
      transaction.add_query(*near, 1);
      transaction.add_query(*far, 2);
      transaction.add_query(*nearest, 1);
      transaction.add_query(*ignores_motion, 1);
    });
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    EXPECT_EQ(near->hits()[0].entity, body_);
    EXPECT_EQ(far->hits()[0].entity, body_) << "it moves 1000 m in 1000 s";
    EXPECT_EQ(far->hits()[1].entity, body_);
    EXPECT_EQ(ignores_motion->hits()[0].entity, body_) << "its pose is that of the version's time";
    ASSERT_EQ(nearest->answers()[0].neighbors.size(), 1u);
    EXPECT_NEAR(nearest->answers()[0].neighbors[0].distance_m, 9.0f, 1e-3f);
  }
}

TEST_F(QueryWindows, AreRefusedIfTooLong) {
  const auto good = prepare_rays(RayMode::closest, false, 2);
  const auto bad = prepare_rays(RayMode::closest, false, 2);
  good->rays()[0] = down_at(1000.0f, 1010.0);
  bad->rays()[0] = down_at(0.0f, 10.0);
  bad->rays()[1] = down_at(0.0f, 11.5);
  const Outcome outcome = execute([&](Transaction& transaction) {
    transaction.add_query(*good, 1);
    transaction.add_query(*bad, 2);
  });
  EXPECT_EQ(outcome.bad_query, 1);
  EXPECT_EQ(describe(outcome),
            "bad_input: the times of its batch run from 10.000000000 s to 11.500000000 s; they may span 1 s, "
            "in query 1; nothing was done");
}

/// A deadline between two windows leaves the answers of the first, and none of an earlier run for the second.
TEST_F(QueryWindows, HaveNoEarlierAnswersAfterADeadlineBetweenThem) {
  const auto near = prepare_rays(RayMode::closest, false, 1);
  const auto far = prepare(RayQueryOptions{.name = "far", .capacity = 1, .late = LatePolicy::partial});
  near->rays()[0] = down_at(0.0f, 10.0);
  far->rays()[0] = down_at(1000.0f, 1010.0);
  const auto add_queries = [&](Transaction& transaction) {
    transaction.add_query(*near, 1);
    transaction.add_query(*far, 1);
  };
  ASSERT_EQ(execute(add_queries).status, Status::committed);
  EXPECT_EQ(far->hits()[0].status, HitStatus::hit);
  EXPECT_EQ(far->answer_info().missing, 0u);
  const auto late = database().make_transaction({.max_queries = 2});
  late->begin({.deadline_class = DeadlineClass::soft, .deadline = clock_time_ns(1)});
  add_queries(*late);
  const Outcome outcome = database().execute(*late);
  EXPECT_EQ(outcome.status, Status::late) << describe(outcome);
  EXPECT_TRUE(outcome.partial);
  EXPECT_EQ(far->hits()[0].status, HitStatus::incomplete);
  EXPECT_EQ(far->answer_info().missing, 1u);
}

}  // namespace
}  // namespace rtstdb::test
