#include "rtstdb/transaction/cost_model.hpp"

#include <gtest/gtest.h>

#include <random>

#include "simulated.hpp"

namespace rtstdb::transaction::test {
namespace {

store::WriteSet rows(std::size_t count) {
  store::WriteSet set;
  set.writes.resize(count);
  return set;
}

TEST(CostLine, FindsBaseAndSlopeInNoise) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 2000.0);
  CostLine line;
  for (int k = 0; k < 500; ++k) {
    const double count = 1.0 + static_cast<double>(random() % 1000);
    line.learn(count, 50'000.0 + 120.0 * count + noise(random));
  }
  EXPECT_NEAR(line.predict_ns(0), 50'000.0, 3000.0);
  EXPECT_NEAR(line.predict_ns(1000), 170'000.0, 3000.0);
}

TEST(CostLine, FollowsAChangedMachine) {
  CostLine line;
  for (int k = 0; k < 500; ++k)
    line.learn(k % 50, 1000.0 + 10.0 * (k % 50));
  for (int k = 0; k < 400; ++k)
    line.learn(k % 50, 9000.0 + 40.0 * (k % 50));
  EXPECT_NEAR(line.predict_ns(20), 9800.0, 100.0);
}

TEST(CostLine, OneCountSaysLittleAboutOthers) {
  CostLine line;
  EXPECT_EQ(line.predict_ns(5), 0.0);
  for (int k = 0; k < 50; ++k)
    line.learn(64, 1000.0);
  EXPECT_NEAR(line.predict_ns(64), 1000.0, 1e-6);
  EXPECT_NEAR(line.predict_ns(128), 2000.0, 1e-6);
  EXPECT_NEAR(line.predict_ns(1), 1000.0, 1e-6);
}

TEST(CostLine, NeverFallsNorGoesBelowZero) {
  CostLine falling;
  for (int k = 0; k < 50; ++k)
    falling.learn(k, 1000.0 - k);
  EXPECT_GE(falling.predict_ns(1e6), falling.predict_ns(0));
  CostLine steep;
  for (int k = 0; k < 50; ++k)
    steep.learn(k, static_cast<double>(k * k));
  for (const double count : {0.0, 1.0, 10.0, 1000.0})
    EXPECT_GE(steep.predict_ns(count), 0.0) << count;
}

TEST(CostModel, PredictsOnlyWhatItHasSeenEnoughOf) {
  CostModel model;
  SimulatedQuery rays(1000, 0, query::QueryKind::ray_closest);
  SimulatedQuery regions(1000, 0, query::QueryKind::region);
  const query::Request both[] = {{&rays, 100}, {&regions, 10}};
  for (std::uint64_t k = 0; k < CostModel::samples_needed; ++k) {
    EXPECT_FALSE(model.predict(rows(1), {}));
    model.learn_writes(rows(1), Nanoseconds(500));
  }
  EXPECT_EQ(model.predict(rows(1), {}), Nanoseconds(500));
  for (std::uint64_t k = 0; k < CostModel::samples_needed; ++k) {
    model.learn_queries(std::span(both, 1), Nanoseconds(10'000));
  }
  EXPECT_EQ(model.predict(rows(1), std::span(both, 1)), Nanoseconds(10'500));
  EXPECT_FALSE(model.predict(rows(1), both)) << "no region was ever asked";
}

TEST(CostModel, TellsKindsInOneTransactionApart) {
  CostModel model;
  SimulatedQuery rays(1000, 0, query::QueryKind::ray_closest);
  SimulatedQuery regions(1000, 0, query::QueryKind::region);
  std::mt19937 random(3);
  const auto cost = [](double ray_count, double region_count) {
    return Nanoseconds(static_cast<std::int64_t>(20'000 + 100 * ray_count + 20'000 + 1000 * region_count));
  };
  for (int k = 0; k < 200; ++k)
    model.learn_writes(rows(0), Nanoseconds(0));
  for (int k = 0; k < 4000; ++k) {
    const query::Request requests[] = {{&rays, static_cast<std::uint32_t>(random() % 1000)},
                                       {&regions, static_cast<std::uint32_t>(random() % 100)}};
    model.learn_queries(requests, cost(requests[0].count, requests[1].count));
  }
  for (const auto& [ray_count, region_count] :
       {std::pair(100u, 10u), std::pair(900u, 10u), std::pair(500u, 90u)}) {
    const query::Request requests[] = {{&rays, ray_count}, {&regions, region_count}};
    const double expected = static_cast<double>(cost(ray_count, region_count).count());
    EXPECT_NEAR(static_cast<double>(model.predict(rows(0), requests)->count()), expected, 0.25 * expected);
  }
}

TEST(CostModel, TellsPositionsFromRows) {
  CostModel model;
  store::WriteSet shape = rows(10);
  shape.shapes.push_back({GeometryId{0}, 1000, 1000, {}});
  for (int k = 0; k < 16; ++k)
    model.learn_writes(rows(10), Nanoseconds(5'000));
  EXPECT_FALSE(model.predict(shape, {})) << "no shape was ever written";
  for (int k = 0; k < 16; ++k)
    model.learn_writes(shape, Nanoseconds(25'000));
  EXPECT_EQ(model.predict(rows(10), {}), Nanoseconds(5'000)) << "rows are as cheap as they were";
  EXPECT_EQ(model.predict(shape, {}), Nanoseconds(25'000));
  shape.shapes.push_back({GeometryId{0}, 1000, 1000, {}});
  EXPECT_EQ(model.predict(shape, {}), Nanoseconds(45'000));
}

}  // namespace
}  // namespace rtstdb::transaction::test
