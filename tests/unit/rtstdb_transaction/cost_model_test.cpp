#include "rtstdb/scheduler/cost_model.hpp"

#include <gtest/gtest.h>

#include <random>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using scheduler::CostLine;
using scheduler::CostModel;

store::WriteSet rows(std::size_t count) {
  store::WriteSet set;
  set.writes.resize(count);
  return set;
}

TEST(CostLine, FitsBaseAndSlopeInNoise) {
  std::mt19937 random(7);
  std::normal_distribution<double> noise(0.0, 2000.0);
  CostLine line;
  for (int k = 0; k < 500; ++k) {
    const double count = 1.0 + static_cast<double>(random() % 1000);
    line.update(count, 50'000.0 + 120.0 * count + noise(random));
  }
  EXPECT_NEAR(line.predict_ns(0), 50'000.0, 3000.0);
  EXPECT_NEAR(line.predict_ns(1000), 170'000.0, 3000.0);
}

TEST(CostLine, FollowsSlowChanges) {
  CostLine line;
  for (int k = 0; k < 500; ++k)
    line.update(k % 50, 1000.0 + 10.0 * (k % 50));
  for (int k = 0; k < 400; ++k)
    line.update(k % 50, 9000.0 + 40.0 * (k % 50));
  EXPECT_NEAR(line.predict_ns(20), 9800.0, 100.0);
}

/// One outlier is a disturbance. Several in a row are a new cost: the world has grown or has been emptied.
TEST(CostLine, FollowsRepeatedOutliers) {
  for (const double now_ns : {20'000.0, 50.0}) {
    SCOPED_TRACE(now_ns);
    CostLine line;
    const auto update_some = [&](int how_many, double cost_ns) {
      for (int k = 0; k < how_many; ++k)
        line.update(64, cost_ns);
    };
    update_some(200, 1000.0);
    update_some(1, now_ns);
    EXPECT_NEAR(line.predict_ns(64), 1000.0, 400.0);
    update_some(20, 1000.0);
    update_some(1, now_ns);
    EXPECT_NEAR(line.predict_ns(64), 1000.0, 700.0) << "usual samples were between the outliers";
    update_some(4, now_ns);
    EXPECT_LT(line.predict_ns(64), 4.0 * now_ns);
    EXPECT_GT(line.promised_ns(64), now_ns);
  }
}

TEST(CostLine, DoesNotExtrapolateFromOldCounts) {
  CostLine line;
  line.update(1, 1000.0);
  for (int k = 0; k < 2'000; ++k)
    line.update(0, k % 3 == 0 ? 0.0 : 1000.0);
  EXPECT_LT(line.predict_ns(16), 20'000.0);
}

TEST(CostLine, IsProportionalAboveASingleKnownCount) {
  CostLine line;
  EXPECT_EQ(line.predict_ns(5), 0.0);
  for (int k = 0; k < 50; ++k)
    line.update(64, 1000.0);
  EXPECT_NEAR(line.predict_ns(64), 1000.0, 1e-6);
  EXPECT_NEAR(line.predict_ns(128), 2000.0, 1e-6);
  EXPECT_NEAR(line.predict_ns(1), 1000.0, 1e-6);
}

TEST(CostLine, IsNeitherFallingNorNegative) {
  CostLine falling;
  for (int k = 0; k < 50; ++k)
    falling.update(k, 1000.0 - k);
  EXPECT_GE(falling.predict_ns(1e6), falling.predict_ns(0));
  CostLine steep;
  for (int k = 0; k < 50; ++k)
    steep.update(k, static_cast<double>(k * k));
  for (const double count : {0.0, 1.0, 10.0, 1000.0})
    EXPECT_GE(steep.predict_ns(count), 0.0) << count;
}

TEST(CostLine, RemembersTheLargestRatioToThePrediction) {
  CostLine line;
  for (int k = 0; k < 100; ++k)
    line.update(64, 1000.0);
  EXPECT_NEAR(line.above(), 1.0, 1e-9);
  line.update(64, 2500.0);
  EXPECT_NEAR(line.above(), 2.5, 1e-6);
  line.update(64, 1e9);
  EXPECT_EQ(line.above(), 4.0) << "the margin is limited";
  for (int k = 0; k < 1000; ++k)
    line.update(64, 1000.0);
  EXPECT_GT(line.above(), 1.5) << "an outlier in a thousand samples counts";
  for (int k = 0; k < 9000; ++k)
    line.update(64, 1000.0);
  EXPECT_LT(line.above(), 1.01);
}

TEST(CostModel, PredictsAKnownQueryByItsOwnSamples) {
  CostModel model;
  SimulatedQuery cheap(1000);
  SimulatedQuery expensive(1000);
  SimulatedQuery unknown(1000);
  model.update_from_writes(rows(0), Nanoseconds(0));
  const auto predicted = [&](SimulatedQuery& query) {
    const query::Request request{&query, 100};
    return model.predict(rows(0), std::span(&request, 1))->mean;
  };
  for (std::uint64_t k = 0; k < CostModel::min_samples; ++k) {
    const query::Request requests[] = {{&cheap, 100}, {&expensive, 100}};
    model.update_from_writes(rows(0), Nanoseconds(0));
    model.update_from_queries(std::span(requests).first(1), Nanoseconds(10'000));
    model.update_from_queries(std::span(requests).last(1), Nanoseconds(90'000));
  }
  EXPECT_EQ(predicted(cheap), Nanoseconds(10'000));
  EXPECT_EQ(predicted(expensive), Nanoseconds(90'000));
  EXPECT_NEAR(static_cast<double>(predicted(unknown).count()), 50'000.0, 2000.0) << "by its cost class";
}

TEST(CostModel, PredictsStructureWorkSeparately) {
  CostModel model;
  SimulatedQuery rays(1000);
  const query::Request request{&rays, 100};
  const std::span one(&request, 1);
  const query::StructureWork refit{.refitted = true, .rows = 10, .entities = 1000};
  const query::StructureWork build{.built = true, .rows = 10, .entities = 1000};
  for (int k = 0; k < 40; ++k) {
    model.update_from_writes(rows(10), Nanoseconds(0));
    model.update_from_queries(one, Nanoseconds(20'000));
  }
  EXPECT_EQ(model.predict(rows(0), one)->mean, Nanoseconds(20'000)) << "no structure work";
  for (int k = 0; k < 40; ++k) {
    model.update_from_queries(one, Nanoseconds(50'000), refit);
    model.update_from_queries(one, Nanoseconds(20'000 + 400'000), build);
  }
  const auto predicted = [&](const store::WriteSet& writes) {
    return static_cast<double>(model.predict(writes, one)->mean.count());
  };
  store::WriteSet update = rows(10);
  for (store::Write& write : update.writes)
    write.kind = store::WriteKind::update;
  store::WriteSet create = rows(10);
  for (store::Write& write : create.writes)
    write.kind = store::WriteKind::create;
  EXPECT_NEAR(predicted(update), 50'000.0, 2'000.0);
  EXPECT_NEAR(predicted(create), 424'000.0, 8'000.0);
  EXPECT_NEAR(predicted(rows(0)), 50'000.0, 2'000.0) << "the last runs refitted";
}

TEST(QueryCostTable, KeepsTheLastUsedQueries) {
  using scheduler::QueryCostTable;
  QueryCostTable table;
  EXPECT_EQ(table.find(1), nullptr);
  table.use(1).structures_share = 0.5;
  for (std::uint64_t id = 2; id <= QueryCostTable::capacity; ++id)
    table.use(id);
  ASSERT_NE(table.find(1), nullptr) << "the table holds `capacity` queries";
  EXPECT_EQ(table.find(1)->structures_share, 0.5);
  table.use(1);
  for (std::uint64_t id = QueryCostTable::capacity + 1; id <= 2 * QueryCostTable::capacity - 128; ++id)
    table.use(id);
  EXPECT_NE(table.find(1), nullptr) << "others of its set were used earlier";
  EXPECT_EQ(table.find(129), nullptr);
  for (std::uint64_t id = 1; id <= 8; ++id)
    table.use(10 * QueryCostTable::capacity + 1 + 128 * id);
  EXPECT_EQ(table.find(1), nullptr);
  EXPECT_EQ(table.use(1).structures_share, 0.0) << "it starts from nothing";
}

TEST(CostModel, PredictsAForgottenQueryByItsCostClass) {
  CostModel model;
  SimulatedQuery cheap(1000);
  const query::Request request{&cheap, 100};
  for (std::uint64_t k = 0; k < CostModel::min_samples; ++k) {
    model.update_from_writes(rows(0), Nanoseconds(0));
    model.update_from_queries(std::span(&request, 1), Nanoseconds(10'000));
  }
  std::vector<std::unique_ptr<SimulatedQuery>> others;
  for (std::size_t k = 0; k < 2 * scheduler::QueryCostTable::capacity; ++k) {
    others.push_back(std::make_unique<SimulatedQuery>(100));
    const query::Request other{others.back().get(), 100};
    model.update_from_queries(std::span(&other, 1), Nanoseconds(20'000));
  }
  EXPECT_NEAR(static_cast<double>(model.predict(rows(0), std::span(&request, 1))->mean.count()), 20'000.0,
              100.0);
}

/// How the model divides `count` elements into chunks of half a millisecond.
query::Request divided(const CostModel& model, SimulatedQuery& query, std::uint32_t count) {
  query::Request request{&query, count};
  model.divide(std::span(&request, 1), Nanoseconds(500'000));
  return request;
}

TEST(CostModel, StartsAnUnknownCostClassWithASmallChunk) {
  const CostModel model;
  SimulatedQuery query(10'000);
  EXPECT_EQ(divided(model, query, 100).per_chunk, 0u);
  const query::Request request = divided(model, query, 1'000);
  EXPECT_EQ(request.per_chunk, 4'096u);
  EXPECT_DOUBLE_EQ(request.initial_chunk_fraction * request.per_chunk, 64.0);
}

TEST(CostModel, StartsAnUnknownQueryOfAKnownCostClassWithASmallChunk) {
  CostModel model;
  SimulatedQuery known(10'000), unknown(10'000);
  const query::Request request{&known, 1'000};
  for (std::uint64_t k = 0; k < CostModel::min_query_samples; ++k)
    model.update_from_queries(std::span(&request, 1), Nanoseconds(500'000));
  EXPECT_EQ(divided(model, known, 1'900).per_chunk, 0u);
  EXPECT_EQ(divided(model, known, 2'100).per_chunk, 1'000u);
  EXPECT_EQ(divided(model, known, 2'100).initial_chunk_fraction, 0.5);
  EXPECT_DOUBLE_EQ(divided(model, unknown, 1'900).initial_chunk_fraction * 1'000.0, 64.0);
  EXPECT_EQ(divided(model, unknown, 500).per_chunk, 0u) << "a small batch is not divided";
}

TEST(CostModel, StartsWithASmallChunkAfterExpensiveElements) {
  CostModel model;
  SimulatedQuery query(10'000);
  const auto run = [&](const query::Request& request, Nanoseconds cost,
                       const query::StructureWork& structures = {}) {
    model.update_from_worst_elements(std::span(&request, 1), cost, structures);
    model.update_from_queries(std::span(&request, 1), Nanoseconds(500'000));
  };
  const query::Request whole{&query, 1'000}, hundred{&query, 100};
  const std::span few(&hundred, 1);
  for (int k = 0; k < 20; ++k)
    run(whole, Nanoseconds(1'500'000));
  EXPECT_EQ(divided(model, query, 1'900).per_chunk, 0u) << "three times the cost is a busy machine";
  run(whole, Nanoseconds(50'000'000), {.refitted = true, .rows = 1'000, .entities = 1'000});
  EXPECT_EQ(divided(model, query, 1'900).per_chunk, 0u) << "the time went into structures";
  model.update_from_worst_elements(few, Nanoseconds(50'000'000), {});
  EXPECT_EQ(divided(model, query, 1'900).per_chunk, 0u) << "a small batch does not count";

  run(whole, Nanoseconds(50'000'000));
  const query::Request request = divided(model, query, 1'900);
  EXPECT_EQ(request.per_chunk, 1'000u);
  EXPECT_NEAR(request.initial_chunk_fraction, 0.01, 1e-6);
  EXPECT_EQ(divided(model, query, 500).per_chunk, 0u);
  for (int k = 0; k < 60; ++k)
    run(whole, Nanoseconds(500'000));
  EXPECT_NEAR(divided(model, query, 1'900).initial_chunk_fraction, 0.025, 0.002) << "the ratio decays";
  for (int k = 0; k < 500; ++k)
    run(whole, Nanoseconds(500'000));
  EXPECT_EQ(divided(model, query, 1'900).per_chunk, 0u);

  query.worst_cost_ratio = 200.0;
  run({.query = &query, .count = 1'000, .per_chunk = 1'000, .chunk_time = Nanoseconds(500'000)},
      Nanoseconds(500'000));
  EXPECT_NEAR(divided(model, query, 1'900).initial_chunk_fraction, 0.005, 1e-6) << "reported for one chunk";
}

TEST(CostModel, MakesChunksLongerThanTheirDispatch) {
  CostModel model;
  SimulatedQuery query(10'000);
  query::Request request{&query, 10'000};
  for (int k = 0; k < 20; ++k)
    model.update_from_queries(std::span(&request, 1), Nanoseconds(10'000'000));
  model.divide(std::span(&request, 1), Nanoseconds(20'000));
  EXPECT_EQ(request.per_chunk, 200u);
  EXPECT_EQ(request.chunk_time, Nanoseconds(200'000));
}

TEST(CostModel, PredictsOnlyAfterEnoughSamples) {
  CostModel model;
  SimulatedQuery rays(1000, 0, query::CostClass::ray_closest);
  SimulatedQuery regions(1000, 0, query::CostClass::region);
  const query::Request both[] = {{&rays, 100}, {&regions, 10}};
  for (std::uint64_t k = 0; k < CostModel::min_samples; ++k) {
    EXPECT_FALSE(model.predict(rows(1), {}));
    model.update_from_writes(rows(1), Nanoseconds(500));
  }
  EXPECT_EQ(model.predict(rows(1), {})->mean, Nanoseconds(500));
  for (std::uint64_t k = 0; k < CostModel::min_samples; ++k) {
    model.update_from_queries(std::span(both, 1), Nanoseconds(10'000));
  }
  EXPECT_EQ(model.predict(rows(1), std::span(both, 1))->mean, Nanoseconds(10'500));
  EXPECT_FALSE(model.predict(rows(1), both)) << "no region query has run";
}

TEST(CostModel, SeparatesTheCostClassesOfOneTransaction) {
  CostModel model;
  SimulatedQuery rays(1000, 0, query::CostClass::ray_closest);
  SimulatedQuery regions(1000, 0, query::CostClass::region);
  std::mt19937 random(3);
  const auto cost = [](double ray_count, double region_count) {
    return Nanoseconds(static_cast<std::int64_t>(20'000 + 100 * ray_count + 20'000 + 1000 * region_count));
  };
  for (int k = 0; k < 200; ++k)
    model.update_from_writes(rows(0), Nanoseconds(0));
  for (int k = 0; k < 4000; ++k) {
    const query::Request requests[] = {{&rays, static_cast<std::uint32_t>(random() % 1000)},
                                       {&regions, static_cast<std::uint32_t>(random() % 100)}};
    model.update_from_queries(requests, cost(requests[0].count, requests[1].count));
  }
  for (const auto& [ray_count, region_count] :
       {std::pair(100u, 10u), std::pair(900u, 10u), std::pair(500u, 90u)}) {
    const query::Request requests[] = {{&rays, ray_count}, {&regions, region_count}};
    const double expected = static_cast<double>(cost(ray_count, region_count).count());
    EXPECT_NEAR(static_cast<double>(model.predict(rows(0), requests)->mean.count()), expected,
                0.25 * expected);
  }
}

TEST(CostModel, SeparatesPositionsFromRows) {
  CostModel model;
  store::WriteSet shape = rows(10);
  shape.shapes.push_back({GeometryId{0}, 1000, 1000, {}});
  for (int k = 0; k < 16; ++k)
    model.update_from_writes(rows(10), Nanoseconds(5'000));
  EXPECT_FALSE(model.predict(shape, {})) << "no shape has been written";
  for (int k = 0; k < 16; ++k)
    model.update_from_writes(shape, Nanoseconds(25'000));
  EXPECT_EQ(model.predict(rows(10), {})->mean, Nanoseconds(5'000)) << "the cost of rows is unchanged";
  EXPECT_EQ(model.predict(shape, {})->mean, Nanoseconds(25'000));
  shape.shapes.push_back({GeometryId{0}, 1000, 1000, {}});
  EXPECT_EQ(model.predict(shape, {})->mean, Nanoseconds(45'000));
}

}  // namespace
}  // namespace rtstdb::transaction::test
