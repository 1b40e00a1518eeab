// Batches in chunks: their answers, their cost, and how long a query of higher priority waits for them.

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <span>
#include <thread>
#include <variant>
#include <vector>

#include "rtstdb/query/dispatch_layout.hpp"
#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/answer_bits.hpp"
#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t batch_size = 200;
/// Of a kind whose batch has a chunk for each element or so.
constexpr std::uint32_t few_searches = 8;
/// Of the other expensive kinds: several workgroups, of which the last is not full.
constexpr std::uint32_t few_elements = 70;

/// Queries of every kind with the same elements in equal worlds. Some rays take more rounds than a dispatch
/// has.
class Chunks : public DatabaseTest {
 protected:
  void make_world(Nanoseconds chunk, bool with_dense = true) {
    open({.chunk = chunk});
    Random random(41);
    const SceneOptions scene{.radius_m = 12.0, .version_time = at_s(5.0)};
    std::vector<GeometryId> geometries;
    for (const TriangleMesh& mesh : mixed_meshes(random))
      geometries.push_back(DatabaseTest::add(mesh));
    const GeometryId dense = DatabaseTest::add(repeated_triangle(30'000));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < 200; ++i)
      rows.push_back(random_row(random, geometries, scene, rows));
    const auto ids = create(rows, scene.version_time);
    if (with_dense) create(row_of(dense, {0.0, 0.0, 5.0}), scene.version_time);
    // More versions than slots.
    for (int k = 1; k <= 6; ++k)
      update_motion(ids[static_cast<std::size_t>(k)], {.valid_from = at_s(5.0 + 0.01 * k)},
                    at_s(5.0 + 0.01 * k));
    entities_ = database().snapshot({}).value();
    rays_.resize(batch_size);
    for (Ray& ray : rays_)
      ray = random_ray(random, entities_, scene, at_s(5.1), 0.5);
  }

  /// Equal calls give equal elements.
  std::vector<std::unique_ptr<KindCase>> all_kinds(bool with_all_options = true) {
    std::vector<std::unique_ptr<KindCase>> all;
    const ElementScene elements{entities_, {.radius_m = 12.0, .version_time = at_s(5.0)}, at_s(5.1), 0.5};
    for (const AnyQueryOptions& options : with_all_options ? all_tested_options() : one_option_per_kind()) {
      // Each contact search has places for some hundred triangles, and each workgroup of them is a chunk.
      // Each impact search has a stage for each pause.
      const bool is_slow = std::holds_alternative<ContactQueryOptions>(options) ||
                           std::holds_alternative<ImpactQueryOptions>(options);
      const std::uint32_t count = is_slow ? few_searches : is_expensive(options) ? few_elements : batch_size;
      all.push_back(prepare_case(database(), with(options, count)));
      Random random(42);
      all.back()->fill(random, elements);
      if (auto* rays = dynamic_cast<RayQuery*>(&all.back()->query())) {
        for (std::size_t i = 7; i < batch_size; i += 100)
          rays->rays()[i] = ray_from({}, {0, 0, 1}, at_s(5.1));
      }
    }
    return all;
  }

  Outcome run_batch(KindCase& query) {
    const Outcome outcome = run(query.query(), query.capacity());
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    return outcome;
  }

  std::vector<EntityState> entities_;
  std::vector<Ray> rays_;
};

TEST_F(Chunks, AnswerAsOneDispatch) {
  std::vector<std::vector<Words>> undivided;
  make_world(Nanoseconds(0));
  for (const auto& query : all_kinds()) {
    run_batch(*query);
    undivided.push_back(query->words());
  }
  // A nanosecond gives chunks of one workgroup, the other time gives larger ones and a smaller last one.
  for (const Nanoseconds chunk : {Nanoseconds(1), Nanoseconds(150'000)}) {
    SCOPED_TRACE(testing::Message() << chunk.count() << " ns");
    make_world(chunk);
    const auto queries = all_kinds();
    for (std::size_t k = 0; k < queries.size(); ++k) {
      run_batch(*queries[k]);  // the first batch of a kind is not divided
      run_batch(*queries[k]);
      EXPECT_TRUE(have_equal_answers(queries[k]->words(), undivided[k])) << queries[k]->name();
    }
  }
}

/// Nested runs at other versions take the slots, while each kind runs in chunks of one workgroup.
TEST_F(Chunks, AnswerAsOneDispatchWithNestedRuns) {
  make_world(Nanoseconds(1));
  const auto queries = all_kinds(false);
  std::vector<std::vector<Words>> alone;
  for (const auto& query : queries) {
    run_batch(*query);
    alone.push_back(query->words());
  }
  std::atomic<bool> stop = false;
  std::atomic<std::size_t> nested_done = 0;
  std::thread nested([&] {
    const auto query = prepare_rays(RayMode::closest, false, 64);
    const auto transaction = database().make_transaction({.max_queries = 1});
    for (Version version = 2; !stop; version = version < 7 ? version + 1 : 2) {
      for (std::uint32_t i = 0; i < 64; ++i) {
        query->rays()[i] = rays_[i];
        query->rays()[i].carrier = {};
        query->rays()[i].t += Nanoseconds(static_cast<std::int64_t>(version) * 1'000'000);
      }
      Terms terms = terms_at({}, ReadAt::pinned(version));
      terms.importance = 1;
      transaction->begin(terms);
      transaction->add_query(*query, 64);
      nested_done += database().execute(*transaction).done() ? 1 : 0;
    }
  });
  Nanoseconds interrupted{0};
  for (std::size_t k = 0; k < queries.size(); ++k) {
    const Outcome outcome = run_batch(*queries[k]);
    interrupted += outcome.interrupted;
    EXPECT_TRUE(have_equal_answers(queries[k]->words(), alone[k])) << queries[k]->name();
    // Long rays continue in many passes: their slot is kept.
    if (dynamic_cast<RayQuery*>(&queries[k]->query()) != nullptr) {
      EXPECT_EQ(outcome.status, Status::committed) << queries[k]->name();
    }
  }
  stop = true;
  nested.join();
  EXPECT_GT(interrupted.count(), 0);
  EXPECT_GT(nested_done, 100u);
}

/// The measured cost includes the dispatches of the chunks. Chunks must not become ever smaller from it. Real
/// time is the subject: the cost of divided batches is compared with that of undivided ones.
TEST_F(Chunks, DoNotBecomeMoreExpensiveWithEachBatch) {
  constexpr std::uint32_t many = 20'000;
  const auto cost = [&](Nanoseconds chunk) {
    make_world(chunk, false);
    const auto query = prepare_rays(RayMode::closest, false, many);
    const auto transaction = database().make_transaction({.max_queries = 1});
    std::vector<Nanoseconds> costs;
    for (int k = 0; k < 60; ++k) {
      for (std::size_t i = 0; i < many; ++i)
        query->rays()[i] = rays_[i % batch_size];
      transaction->begin({});
      transaction->add_query(*query, many);
      const Outcome& outcome = database().execute(*transaction);
      EXPECT_TRUE(outcome.done());
      if (k >= 40) costs.push_back(outcome.actual_cost);
    }
    std::ranges::sort(costs);
    return costs[costs.size() / 2];
  };
  const Nanoseconds undivided = cost(Nanoseconds(0));
  const Nanoseconds divided = cost(Nanoseconds(50'000));
  RecordProperty("undivided_ns", std::to_string(undivided.count()));
  RecordProperty("divided_ns", std::to_string(divided.count()));
  EXPECT_LT(divided, 6 * undivided);
}

/// The median time that a small query of higher priority takes while large batches run one after the other.
/// Real time is the subject: it bounds the preemption latency.
class HigherPriorityQueries : public Chunks {
 protected:
  /// The cost is predicted from a first batch of `measured` elements.
  Nanoseconds median_wait(std::span<const Ray> rays, std::uint32_t measured) {
    const auto many = static_cast<std::uint32_t>(rays.size());
    const auto large = prepare_rays(RayMode::closest, false, many);
    std::ranges::copy(rays, large->rays().begin());
    return median_wait(*large, many, measured);
  }
  template <class Query>
  Nanoseconds median_wait(Query& large, std::uint32_t many, std::uint32_t measured) {
    const auto background = database().make_transaction({.max_queries = 1});
    const auto run_large = [&](std::uint32_t count) {
      background->begin({});
      background->add_query(large, count);
      return database().execute(*background);
    };
    const Outcome first = run_large(measured);
    EXPECT_TRUE(first.done());
    element_cost_ = first.actual_cost / measured;
    const std::int64_t large_ns = element_cost_.count() * many;
    // Before the large batches, for which it would wait.
    const auto small = prepare_rays(RayMode::closest, false, 64);
    std::atomic<bool> stop = false;
    std::thread thread([&] {
      while (!stop)
        run_large(many);
    });
    std::vector<Nanoseconds> waits = preemption_waits(*small);
    stop = true;
    database().cancel(*background);
    thread.join();
    std::ranges::sort(waits);
    RecordProperty("large_ns", std::to_string(large_ns));
    RecordProperty("median_wait_ns", std::to_string(waits[waits.size() / 2].count()));
    RecordProperty("longest_wait_ns", std::to_string(waits.back().count()));
    EXPECT_GT(large_ns, 50'000'000) << "the batch is too short";
    return waits[waits.size() / 2];
  }

  Nanoseconds preemption_wait(Transaction& higher, RayQuery& small) {
    std::ranges::copy(std::span(rays_).last(64), small.rays().begin());
    Terms terms;
    terms.importance = 1;
    higher.begin(terms);
    higher.add_query(small, 64);
    const Outcome& outcome = database().execute(higher);
    EXPECT_TRUE(outcome.done());
    return outcome.published - outcome.submitted;
  }

  Nanoseconds element_cost_{0};

 private:
  std::vector<Nanoseconds> preemption_waits(RayQuery& small) {
    const auto higher = database().make_transaction({.max_queries = 1});
    std::vector<Nanoseconds> waits;
    for (int k = 0; k < 60; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(3));  // comes at any time of a chunk
      waits.push_back(preemption_wait(*higher, small));
    }
    return waits;
  }
};

TEST_F(HigherPriorityQueries, PreemptLargeBatches) {
  make_world(Nanoseconds(1'000'000), false);
  std::vector<Ray> many(400'000);
  for (std::size_t i = 0; i < many.size(); ++i)
    many[i] = rays_[i % batch_size];
  EXPECT_LT(median_wait(many, 400'000), std::chrono::milliseconds(5));
}

TEST_F(HigherPriorityQueries, PreemptPausedSearches) {
  make_world(Nanoseconds(1'000'000), false);
  create(row_of(DatabaseTest::add(repeated_triangle(100'000)), {0.0, 0.0, 50.0}), at_s(5.1));
  std::vector<Ray> many(400, ray_from({0.0f, 0.0f, 45.0f}, {0, 0, 1}, at_s(5.1)));
  EXPECT_LT(median_wait(many, 400), std::chrono::milliseconds(5));
}

/// In the first pass of the batch, without work sharing.
TEST_F(HigherPriorityQueries, PreemptSearchesBeforeTheyPause) {
  open({.chunk = Nanoseconds(1'000'000)});
  create(row_of(DatabaseTest::add(repeated_triangle(100'000)), {0.0, 0.0, 50.0}), at_s(5.1));
  rays_.assign(64, ray_from({0.0f, 0.0f, 45.0f}, {0, 0, -1}, at_s(5.1)));
  std::vector<Ray> many;
  for (int i = 0; i < 20'000; ++i) {
    const auto column = static_cast<float>(i % 4), row = static_cast<float>(i / 4 % 3);
    many.push_back(ray_from({0.3f * column - 0.45f, 0.3f * row - 0.8f, 45.0f}, {0, 0, 1}, at_s(5.1)));
  }
  ASSERT_FALSE(query::are_coherent(many));
  EXPECT_LT(median_wait(many, 200), std::chrono::milliseconds(5));
}

/// By the cost of the cheap rays, a chunk would have hundreds of the expensive ones.
TEST_F(HigherPriorityQueries, PreemptExpensiveRaysAfterCheapOnes) {
  open({.chunk = Nanoseconds(1'000'000)});
  create(row_of(DatabaseTest::add(repeated_triangle(3'000)), {0.0, 0.0, 50.0}), at_s(5.1));
  const Ray cheap = ray_from({0.0f, 0.0f, 45.0f}, {0, 0, -1}, at_s(5.1));
  const Ray expensive = ray_from({0.0f, 0.0f, 45.0f}, {0, 0, 1}, at_s(5.1));
  rays_.assign(64, cheap);
  constexpr std::uint32_t measured = 60'000;
  std::vector<Ray> many(1'200'000, expensive);
  std::fill_n(many.begin(), measured, cheap);
  EXPECT_LT(median_wait(many, measured), std::chrono::milliseconds(3));
}

/// There is no prediction yet for elements of some 50 us.
TEST_F(HigherPriorityQueries, PreemptTheFirstBatchOfItsKind) {
  open({.chunk = Nanoseconds(1'000'000)});
  create(row_of(DatabaseTest::add(repeated_triangle(3'000)), {0.0, 0.0, 50.0}), at_s(5.1));
  constexpr std::uint32_t many = 8'000;
  const auto large = prepare(NearestQueryOptions{.name = "first", .capacity = many});
  for (Nearest& point : large->points()) {
    point.point_m = {0.0f, 0.0f, 50.0f};
    point.t = at_s(5.1);
  }
  const auto small = prepare_rays(RayMode::closest, false, 64);
  rays_.assign(64, ray_from({0.0f, 0.0f, 45.0f}, {0, 0, -1}, at_s(5.1)));
  const auto higher = database().make_transaction({.max_queries = 1});
  const auto background = database().make_transaction({.max_queries = 1});
  for (int k = 0; k < 20; ++k)
    preemption_wait(*higher, *small);
  background->begin({});
  background->add_query(*large, many);
  database().submit(*background);
  std::vector<Nanoseconds> waits;
  for (int k = 0; k < 5; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(3));  // comes at any time of a chunk
    waits.push_back(preemption_wait(*higher, *small));
  }
  database().cancel(*background);
  EXPECT_EQ(database().wait(*background).status, Status::cancelled) << "the batch is too short";
  std::ranges::sort(waits);
  EXPECT_LT(waits[waits.size() / 2], std::chrono::milliseconds(5));
}

/// Regions whose search has begun complete: as many as all processors have lanes.
TEST_F(HigherPriorityQueries, PreemptExpensiveRegions) {
  open({.chunk = Nanoseconds(1'000'000)});
  const GeometryId box = DatabaseTest::add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < 4'000; ++i)
    rows.push_back(row_of(box, 2.0 * glm::dvec3(glm::uvec3(i % 200, i / 200, 0))));
  create(rows, at_s(5.1));
  rays_.assign(64, ray_from({0.0f, 0.0f, 45.0f}, {0, 0, 1}, at_s(5.1)));
  constexpr std::uint32_t many = 4'000;
  const auto large = prepare(RegionQueryOptions{.name = "all", .capacity = many, .ids_per_region = 64});
  for (Region& region : large->regions()) {
    region.half_extent_m = glm::vec3(1e4f);
    region.t = at_s(5.1);
  }
  const Nanoseconds wait = median_wait(*large, many, 100);
  const std::uint32_t in_flight = query::min_places(std::thread::hardware_concurrency());
  EXPECT_LT(wait, database().device().software ? 2 * in_flight * element_cost_ : Nanoseconds(5'000'000));
}

}  // namespace
}  // namespace rtstdb::test
