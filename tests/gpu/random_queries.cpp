#include "tests/gpu/random_queries.hpp"

#include <algorithm>

#include "tests/support/rounds.hpp"

namespace rtstdb::test {
void RandomQueries::fill(const RandomWorld& world) {
  random_ = Random(world.seed);
  scene_ = {.radius_m = world.radius_m, .version_time = at_s(random_.uniform(-1e5, 1e5))};
  std::vector<GeometryId> geometries;
  for (const TriangleMesh& mesh : mixed_meshes(random_))
    geometries.push_back(add(mesh));
  std::vector<EntityRow> rows;
  for (std::uint32_t i = 0; i < world.entities; ++i)
    rows.push_back(random_row(random_, geometries, scene_, rows));
  const WorldTime before = scene_.version_time - Nanoseconds(10'000'000'000);
  const WorldTime between = scene_.version_time - Nanoseconds(5'000'000'000);
  const auto ids = create(rows, before);
  const auto change = [&](const std::function<void(Transaction&, std::uint32_t)>& one_in_five,
                          WorldTime time) {
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          for (std::uint32_t i = 0; i < world.entities; i += 5)
            one_in_five(transaction, i);
        },
        time);
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
  };
  change([&](Transaction& transaction, std::uint32_t i) { transaction.remove(ids[i]); }, between);
  // The device builds the structures that the next version changes.
  trace(ray_from({}, {1, 0, 0}, between));
  change(
      [&](Transaction& transaction, std::uint32_t i) {
        transaction.create(random_row(random_, geometries, scene_, rows));
        if (i + 1 < world.entities)
          transaction.update(ids[i + 1], random_row(random_, geometries, scene_, rows));
      },
      scene_.version_time);
  oracle_world_ = this->world();
  ASSERT_EQ(oracle_world_->entities().size(), world.entities);
}

RandomQueries::Window RandomQueries::random_window() {
  constexpr std::int64_t delays_ns[] = {0, 0, 700'000'000, 1'400'000'000, 5'300'000'000};
  Window window{.first = scene_.version_time + Nanoseconds(delays_ns[random_.below(std::size(delays_ns))])};
  if (random_.one_in(6)) return window;
  window.length_s = random_.one_in(2) ? random_.uniform(0.0, 1.0) : random_.magnitude(1e-3, 1.0);
  return window;
}

template <class Fill>
Tally RandomQueries::run_batches(KindCase& query, std::size_t count, Fill fill) {
  count = hil::tests::rounds(std::min<std::size_t>(count, batch + count / 3), count);
  Tally tally;
  while (tally.elements < count && !HasFailure()) {
    fill(query, random_window());
    const Outcome outcome = run(query.query(), batch);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    tally += query.judge(*oracle_world_);
  }
  return tally;
}

Tally RandomQueries::run_random(const AnyQueryOptions& options, std::size_t count) {
  const auto query = prepare_case(database(), with(options, batch));
  if (query == nullptr) return {};
  return run_batches(*query, count, [&](KindCase& filled, const Window& window) {
    filled.fill(random_, elements_in(window));
  });
}

Tally RandomQueries::run_neighbours(const RayQueryOptions& options, std::size_t count) {
  const auto query = prepare_case(database(), with(options, batch));
  if (query == nullptr) return {};
  return run_batches(*query, count, [&](KindCase& filled, const Window& window) {
    fill_with_neighbours(dynamic_cast<RayQuery&>(filled.query()).rays(), random_, oracle_world_->entities(),
                         scene_, window.first, window.length_s);
  });
}

void expect_informative(const Tally& tally, double max_too_close) {
  testing::Test::RecordProperty("elements", std::to_string(tally.elements));
  testing::Test::RecordProperty("hits", std::to_string(tally.hits));
  testing::Test::RecordProperty("too_close", std::to_string(tally.too_close));
  if (testing::Test::HasFailure()) return;
  EXPECT_GT(tally.hits, tally.elements / 5) << "most elements hit nothing";
  EXPECT_LT(tally.hits, tally.elements * 4 / 5) << "most elements hit something";
  EXPECT_LE(static_cast<double>(tally.too_close), max_too_close * static_cast<double>(tally.elements));
}

}  // namespace rtstdb::test
