// Queries that are prepared when geometry is added: connected again there and not in the tick that asks them
// next, and what that takes is no transaction's.

#include "rtstdb/query/gpu_executor.hpp"
#include "rtstdb/query/ray/ray_query.hpp"
#include "tests/gpu/database_test.hpp"
#include "tests/gpu/gpu_test.hpp"
#include "tests/gpu/prepare_on.hpp"

namespace rtstdb::test {
namespace {

TEST(PreparedQueriesOnTheDevice, AreConnectedAgainWhereThePoolHasGrown) {
  auto executor =
      std::move(query::GpuExecutor::create(
                    [](const auto&) { return gpu::Device::open(gpu::test::shared_device_options()); },
                    DatabaseOptions{.max_entities = 4}))
          .value();
  const auto prepare = [&] {
    return std::move(
               prepare_on<query::GpuRayQuery>(*executor, RayQueryOptions{.name = "rays", .capacity = 4}))
        .value();
  };
  const auto first = prepare();
  auto second = prepare();
  const std::uint32_t before = first->bound_generation;
  ASSERT_TRUE(executor->add_geometry(std::make_shared<const TriangleMesh>(make_sphere(1.0, 6)), {}).ok());
  EXPECT_NE(first->bound_generation, before);
  EXPECT_EQ(second->bound_generation, first->bound_generation);
  second.reset();
  const std::uint32_t after = first->bound_generation;
  ASSERT_TRUE(executor->add_geometry(std::make_shared<const TriangleMesh>(make_sphere(1.0, 8)), {}).ok());
  EXPECT_NE(first->bound_generation, after);
  EXPECT_TRUE(executor->device_health().validation_messages.empty());
}

using WhatATransactionTook = DatabaseTest;

TEST_F(WhatATransactionTook, LeavesOutTheSetupBeforeIt) {
  create(row_of(add(make_sphere(1.0, 6))));
  auto rays = database().prepare(RayQueryOptions{.name = "rays", .capacity = 1});
  ASSERT_TRUE(rays.ok());
  rays.value()->rays()[0] = ray_from({-3.0, 0.0, 0.0}, {1.0, 0.0, 0.0});
  const Outcome outcome = execute([&](Transaction& transaction) { transaction.add_query(*rays.value(), 1); });
  ASSERT_EQ(outcome.status, Status::committed);
  EXPECT_GT(outcome.gpu_time.count(), 0);
  EXPECT_LE(outcome.gpu_time, outcome.actual_cost);
}

}  // namespace
}  // namespace rtstdb::test
