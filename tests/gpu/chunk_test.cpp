// Batches that are carried out in chunks: what they answer, and who passes them.

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <span>
#include <thread>
#include <vector>

#include "rtstdb/query/dispatch_layout.hpp"
#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/answer_bits.hpp"
#include "tests/gpu/dense_meshes.hpp"
#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

constexpr std::uint32_t batch_size = 500;

/// Every kind of query, each over the same elements in a world made from the same seed, among them some that
/// take more than a dispatch gives.
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
    // More versions than there are slots.
    for (int k = 1; k <= 6; ++k)
      update_motion(ids[static_cast<std::size_t>(k)], {.valid_from = at_s(5.0 + 0.01 * k)},
                    at_s(5.0 + 0.01 * k));
    entities_ = database().snapshot({}).value();
    rays_.resize(batch_size);
    for (Ray& ray : rays_)
      ray = random_ray(random, entities_, scene, at_s(5.1), 0.5);
  }

  /// Each kind with the same elements every time.
  std::vector<std::unique_ptr<KindCase>> all_kinds() {
    std::vector<std::unique_ptr<KindCase>> all;
    const ElementScene elements{entities_, {.radius_m = 12.0, .version_time = at_s(5.0)}, at_s(5.1), 0.5};
    for (const AnyQueryOptions& options : options_of_every_kind()) {
      all.push_back(prepare_case(database(), with(options, batch_size)));
      Random random(42);
      all.back()->fill(random, elements);
      if (auto* rays = dynamic_cast<RayQuery*>(&all.back()->query())) {
        for (std::size_t i = 7; i < batch_size; i += 100)
          rays->rays()[i] = ray_from({}, {0, 0, 1}, at_s(5.1));
      }
    }
    return all;
  }

  Outcome run(KindCase& query) {
    const Outcome outcome =
        execute([&](Transaction& transaction) { transaction.add_query(query.query(), batch_size); });
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    return outcome;
  }

  std::vector<EntityState> entities_;
  std::vector<Ray> rays_;
};

TEST_F(Chunks, AnswerAsTheWholeBatch) {
  std::vector<std::vector<Words>> whole;
  make_world(Nanoseconds(0));
  for (const auto& query : all_kinds()) {
    run(*query);
    whole.push_back(query->words());
  }
  // A nanosecond divides into single workgroups, the other into more, and not evenly.
  for (const Nanoseconds chunk : {Nanoseconds(1), Nanoseconds(150'000)}) {
    SCOPED_TRACE(testing::Message() << chunk.count() << " ns");
    make_world(chunk);
    const auto queries = all_kinds();
    for (std::size_t k = 0; k < queries.size(); ++k) {
      run(*queries[k]);  // before this nothing is known of the kind, and it is not divided
      run(*queries[k]);
      EXPECT_TRUE(same(queries[k]->words(), whole[k])) << queries[k]->name();
    }
  }
}

/// Small urgent ones at other versions take the slots, while every kind is asked in single workgroups.
TEST_F(Chunks, AnswerAsTheWholeBatchWithOthersInTheirGaps) {
  make_world(Nanoseconds(1));
  const auto queries = all_kinds();
  std::vector<std::vector<Words>> alone;
  for (const auto& query : queries) {
    run(*query);
    alone.push_back(query->words());
  }
  std::atomic<bool> stop = false;
  std::atomic<std::size_t> urgent_done = 0;
  std::thread others([&] {
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
      urgent_done += database().execute(*transaction).done() ? 1 : 0;
    }
  });
  Nanoseconds interrupted{0};
  for (std::size_t k = 0; k < queries.size(); ++k) {
    const Outcome outcome = run(*queries[k]);
    interrupted += outcome.interrupted;
    EXPECT_TRUE(same(queries[k]->words(), alone[k])) << queries[k]->name();
    // Some take many passes, in a slot that the others leave alone.
    if (dynamic_cast<RayQuery*>(&queries[k]->query()) != nullptr) {
      EXPECT_EQ(outcome.status, Status::committed) << queries[k]->name();
    }
  }
  stop = true;
  others.join();
  EXPECT_GT(interrupted.count(), 0);
  EXPECT_GT(urgent_done, 100u);
}

/// What they took is learnt with the dispatches of their chunks; so chunks would become ever smaller and
/// batches ever dearer.
TEST_F(Chunks, CostNoMoreTheMoreOftenTheyAreAsked) {
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
  const Nanoseconds whole = cost(Nanoseconds(0));
  const Nanoseconds divided = cost(Nanoseconds(50'000));
  RecordProperty("whole_ns", std::to_string(whole.count()));
  RecordProperty("divided_ns", std::to_string(divided.count()));
  EXPECT_LT(divided, 6 * whole);
}

/// A crowd of batches without end, and the median time that an urgent small query waits for its answers
/// beside them.
class Urgent : public Chunks {
 protected:
  /// The database knows what they cost from the first `known` of them.
  Nanoseconds median_wait(std::span<const Ray> crowd, std::uint32_t known) {
    const auto many = static_cast<std::uint32_t>(crowd.size());
    const auto large = prepare_rays(RayMode::closest, false, many);
    std::ranges::copy(crowd, large->rays().begin());
    return median_wait(*large, many, known);
  }
  template <class Query>
  Nanoseconds median_wait(Query& large, std::uint32_t many, std::uint32_t known) {
    const auto flood = database().make_transaction({.max_queries = 1});
    const auto ask_large = [&](std::uint32_t count) {
      flood->begin({});
      flood->add_query(large, count);
      return database().execute(*flood);
    };
    const Outcome first = ask_large(known);
    EXPECT_TRUE(first.done());
    one_of_the_crowd_ = first.actual_cost / known;
    const std::int64_t large_ns = one_of_the_crowd_.count() * many;
    // Setup would wait for the crowd.
    const auto small = prepare_rays(RayMode::closest, false, 64);
    std::atomic<bool> stop = false;
    std::thread flooder([&] {
      while (!stop)
        ask_large(many);
    });
    std::vector<Nanoseconds> waits = waits_of_urgent_ones(*small);
    stop = true;
    database().cancel(*flood);
    flooder.join();
    std::ranges::sort(waits);
    RecordProperty("large_ns", std::to_string(large_ns));
    RecordProperty("median_wait_ns", std::to_string(waits[waits.size() / 2].count()));
    RecordProperty("longest_wait_ns", std::to_string(waits.back().count()));
    EXPECT_GT(large_ns, 50'000'000) << "a batch is no crowd";
    return waits[waits.size() / 2];
  }

  Nanoseconds wait_of_urgent_one(Transaction& urgent, RayQuery& small) {
    std::ranges::copy(std::span(rays_).last(64), small.rays().begin());
    Terms terms;
    terms.importance = 1;
    urgent.begin(terms);
    urgent.add_query(small, 64);
    const Outcome& outcome = database().execute(urgent);
    EXPECT_TRUE(outcome.done());
    return outcome.published - outcome.submitted;
  }

  Nanoseconds one_of_the_crowd_{0};

 private:
  std::vector<Nanoseconds> waits_of_urgent_ones(RayQuery& small) {
    const auto urgent = database().make_transaction({.max_queries = 1});
    std::vector<Nanoseconds> waits;
    for (int k = 0; k < 60; ++k) {
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
      waits.push_back(wait_of_urgent_one(*urgent, small));
    }
    return waits;
  }
};

TEST_F(Urgent, QueriesPassLargeBatches) {
  make_world(Nanoseconds(1'000'000), false);
  std::vector<Ray> many(400'000);
  for (std::size_t i = 0; i < many.size(); ++i)
    many[i] = rays_[i % batch_size];
  EXPECT_LT(median_wait(many, 400'000), std::chrono::milliseconds(5));
}

TEST_F(Urgent, QueriesPassSearchesThatPause) {
  make_world(Nanoseconds(1'000'000), false);
  create(row_of(DatabaseTest::add(repeated_triangle(100'000)), {0.0, 0.0, 50.0}), at_s(5.1));
  std::vector<Ray> many(400, ray_from({0.0f, 0.0f, 45.0f}, {0, 0, 1}, at_s(5.1)));
  EXPECT_LT(median_wait(many, 400), std::chrono::milliseconds(5));
}

/// Before any is asked again; where entities are few each is searched by a lane alone.
TEST_F(Urgent, QueriesPassSearchesThatWillPause) {
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

/// By what the others take, a chunk would hold hundreds of the costly ones.
TEST_F(Urgent, QueriesPassCostlyRaysBehindCheapOnes) {
  open({.chunk = Nanoseconds(1'000'000)});
  create(row_of(DatabaseTest::add(repeated_triangle(3'000)), {0.0, 0.0, 50.0}), at_s(5.1));
  const Ray cheap = ray_from({0.0f, 0.0f, 45.0f}, {0, 0, -1}, at_s(5.1));
  const Ray costly = ray_from({0.0f, 0.0f, 45.0f}, {0, 0, 1}, at_s(5.1));
  rays_.assign(64, cheap);
  constexpr std::uint32_t known = 60'000;
  std::vector<Ray> many(600'000, costly);
  std::fill_n(many.begin(), known, cheap);
  EXPECT_LT(median_wait(many, known), std::chrono::milliseconds(3));
}

/// Nothing is known of its kind, and each of them takes some 50 us.
TEST_F(Urgent, QueriesPassTheFirstBatchOfItsKind) {
  open({.chunk = Nanoseconds(1'000'000)});
  const GeometryId crowded = DatabaseTest::add(repeated_triangle(3'000));
  create(row_of(crowded, {0.0, 0.0, 50.0}), at_s(5.1));
  constexpr std::uint32_t many = 8'000;
  auto large = database().prepare(NearestQueryOptions{.name = "first", .capacity = many});
  ASSERT_TRUE(large.ok());
  for (Nearest& point : large.value()->points()) {
    point.point_m = {0.0f, 0.0f, 50.0f};
    point.t = at_s(5.1);
  }
  const auto small = prepare_rays(RayMode::closest, false, 64);
  rays_.assign(64, ray_from({0.0f, 0.0f, 45.0f}, {0, 0, -1}, at_s(5.1)));
  const auto urgent = database().make_transaction({.max_queries = 1});
  const auto flood = database().make_transaction({.max_queries = 1});
  for (int k = 0; k < 20; ++k)
    wait_of_urgent_one(*urgent, *small);
  flood->begin({});
  flood->add_query(*large.value(), many);
  database().submit(*flood);
  std::vector<Nanoseconds> waits;
  for (int k = 0; k < 5; ++k) {
    std::this_thread::sleep_for(std::chrono::milliseconds(3));
    waits.push_back(wait_of_urgent_one(*urgent, *small));
  }
  database().cancel(*flood);
  EXPECT_EQ(database().wait(*flood).status, Status::cancelled) << "a batch is no crowd";
  std::ranges::sort(waits);
  EXPECT_LT(waits[waits.size() / 2], std::chrono::milliseconds(5));
}

/// Those that are under way are let finish, which are as many as processors have lanes.
TEST_F(Urgent, QueriesPassRegionsThatTakeLong) {
  open({.chunk = Nanoseconds(1'000'000)});
  const GeometryId box = DatabaseTest::add(make_box({1.0, 1.0, 1.0}));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < 4'000; ++i)
    rows.push_back(row_of(box, 2.0 * glm::dvec3(glm::uvec3(i % 200, i / 200, 0))));
  create(rows, at_s(5.1));
  rays_.assign(64, ray_from({0.0f, 0.0f, 45.0f}, {0, 0, 1}, at_s(5.1)));
  constexpr std::uint32_t many = 4'000;
  auto large = database().prepare(RegionQueryOptions{.name = "all", .capacity = many, .ids_per_region = 64});
  ASSERT_TRUE(large.ok());
  for (Region& region : large.value()->regions()) {
    region.half_extent_m = glm::vec3(1e4f);
    region.t = at_s(5.1);
  }
  const Nanoseconds wait = median_wait(*large.value(), many, 100);
  const std::uint32_t under_way = query::min_places(std::thread::hardware_concurrency());
  EXPECT_LT(wait, database().device().software ? 2 * under_way * one_of_the_crowd_ : Nanoseconds(5'000'000));
}

}  // namespace
}  // namespace rtstdb::test
