// When the geometry pool grows, add_geometry rebinds the prepared queries: the next transaction neither does
// this nor counts it as its cost.

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/executor_fixture.hpp"

namespace rtstdb::test {
namespace {

using PreparedQueries = ExecutorTest;

TEST_F(PreparedQueries, AreReboundWhenThePoolGrows) {
  open({.max_entities = 4});
  const auto first = prepare_rays(4);
  auto second = prepare_rays(4);
  const std::uint32_t before = first->bound_generation;
  add(make_sphere(1.0, 6));
  EXPECT_NE(first->bound_generation, before);
  EXPECT_EQ(second->bound_generation, first->bound_generation);
  second.reset();
  const std::uint32_t after = first->bound_generation;
  add(make_sphere(1.0, 8));
  EXPECT_NE(first->bound_generation, after);
}

using TransactionCosts = DatabaseTest;

TEST_F(TransactionCosts, LeaveOutTheSetupBeforeThem) {
  create(row_of(add(make_sphere(1.0, 6))));
  const auto rays = prepare_rays(RayMode::closest, false, 1);
  rays->rays()[0] = ray_from({-3.0, 0.0, 0.0}, {1.0, 0.0, 0.0});
  const Outcome outcome = run(*rays, 1);
  ASSERT_EQ(outcome.status, Status::committed);
  EXPECT_GT(outcome.gpu_time.count(), 0);
  EXPECT_LE(outcome.gpu_time, outcome.actual_cost);
}

}  // namespace
}  // namespace rtstdb::test
