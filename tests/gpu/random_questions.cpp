#include "tests/gpu/random_questions.hpp"

#include <algorithm>

#include "tests/support/rounds.hpp"

namespace rtstdb::test {
void RandomQuestions::fill(const RandomWorld& world) {
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
  // So that the device has built what the next version changes.
  trace(ray_from({}, {1, 0, 0}, between));
  change(
      [&](Transaction& transaction, std::uint32_t i) {
        transaction.create(random_row(random_, geometries, scene_, rows));
        if (i + 1 < world.entities)
          transaction.update(ids[i + 1], random_row(random_, geometries, scene_, rows));
      },
      scene_.version_time);
  everything_ = this->world();
  ASSERT_EQ(everything_->entities().size(), world.entities);
}

RandomQuestions::Window RandomQuestions::random_window() {
  constexpr std::int64_t waits_ns[] = {0, 0, 700'000'000, 1'400'000'000, 5'300'000'000};
  Window window{.first = scene_.version_time + Nanoseconds(waits_ns[random_.below(std::size(waits_ns))])};
  if (random_.one_in(6)) return window;
  window.length_s = random_.one_in(2) ? random_.uniform(0.0, 1.0) : random_.magnitude(1e-3, 1.0);
  return window;
}

template <class Fill>
Tally RandomQuestions::ask_batches(KindCase& query, std::size_t count, Fill fill) {
  count = hil::tests::rounds(std::min<std::size_t>(count, batch + count / 3), count);
  Tally tally;
  while (tally.asked < count && !HasFailure()) {
    fill(query, random_window());
    const Outcome outcome =
        execute([&](Transaction& transaction) { transaction.add_query(query.query(), batch); });
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    tally += query.judge(*everything_);
  }
  return tally;
}

Tally RandomQuestions::ask(const AnyQueryOptions& wanted, std::size_t count) {
  const auto query = prepare_case(database(), with(wanted, batch));
  if (query == nullptr) return {};
  return ask_batches(*query, count, [&](KindCase& filled, const Window& window) {
    filled.fill(random_, elements_in(window));
  });
}

Tally RandomQuestions::ask_neighbours(const RayQueryOptions& wanted, std::size_t count) {
  const auto query = prepare_case(database(), with(wanted, batch));
  if (query == nullptr) return {};
  return ask_batches(*query, count, [&](KindCase& filled, const Window& window) {
    const auto rays = dynamic_cast<RayQuery&>(filled.query()).rays();
    std::vector<Ray> neighbours;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      if (i % 8 == 0)
        neighbours =
            random_neighbours(random_, everything_->entities(), scene_, window.first, window.length_s);
      rays[i] = neighbours[i % 8];
    }
  });
}

void expect_telling(const Tally& tally, double max_too_close) {
  testing::Test::RecordProperty("asked", std::to_string(tally.asked));
  testing::Test::RecordProperty("hits", std::to_string(tally.hits));
  testing::Test::RecordProperty("too_close", std::to_string(tally.too_close));
  if (testing::Test::HasFailure()) return;
  EXPECT_GT(tally.hits, tally.asked / 5) << "a world that shows little";
  EXPECT_LT(tally.hits, tally.asked * 4 / 5) << "a world that shows little";
  EXPECT_LE(static_cast<double>(tally.too_close), max_too_close * static_cast<double>(tally.asked));
}

}  // namespace rtstdb::test
