#include "tests/gpu/random_questions.hpp"

#include <algorithm>

#include "tests/support/rounds.hpp"

namespace rtstdb::test {
namespace {

/// What counts alone was answered, as the oracle judges it: a list that had no room.
std::vector<RegionAnswer> counts_as_lists(std::span<const RegionAnswer> counts) {
  std::vector<RegionAnswer> lists(counts.begin(), counts.end());
  for (RegionAnswer& answer : lists) {
    EXPECT_TRUE(answer.entities.empty() && answer.triangles.empty() && !answer.overflow);
    answer.overflow = answer.found > 0;
  }
  return lists;
}

}  // namespace

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

template <class Query, class Elements, class Fill, class Judged>
Tally RandomQuestions::ask_batches(Query& query, Elements elements, std::size_t count, Fill fill,
                                   Judged judged) {
  count = hil::tests::rounds(std::min<std::size_t>(count, batch + count / 3), count);
  Tally tally;
  while (tally.asked < count && !HasFailure()) {
    const Window window = random_window();
    for (auto& element : elements)
      element = fill(window);
    const Outcome outcome = execute([&](Transaction& transaction) { transaction.add_query(query, batch); });
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    tally += judged();
  }
  return tally;
}

template <class MakeRay>
Tally RandomQuestions::ask_rays(RayQueryOptions wanted, std::size_t count, MakeRay make_ray) {
  wanted.capacity = batch;
  const auto query = database().prepare(wanted).value();
  // The query's own span need not be readable at speed.
  std::vector<Ray> rays(batch);
  return ask_batches(*query, query->rays(), count, make_ray, [&] {
    std::ranges::copy(query->rays(), rays.begin());
    return judge(*everything_, rays, query->hits(), wanted);
  });
}

Tally RandomQuestions::ask(RayQueryOptions wanted, std::size_t count) {
  return ask_rays(std::move(wanted), count, [&](const Window& window) {
    return random_ray(random_, everything_->entities(), scene_, window.first, window.length_s);
  });
}

Tally RandomQuestions::ask_neighbours(RayQueryOptions wanted, std::size_t count) {
  std::vector<Ray> neighbours;
  std::size_t made = 0;
  return ask_rays(std::move(wanted), count, [&](const Window& window) {
    const std::size_t place = made++ % batch % 8;
    if (place == 0) {
      neighbours = random_neighbours(random_, everything_->entities(), scene_, window.first, window.length_s);
    }
    return neighbours[place];
  });
}

Tally RandomQuestions::ask(NearestQueryOptions wanted, std::size_t count) {
  wanted.capacity = batch;
  const auto query = database().prepare(wanted).value();
  return ask_batches(
      *query, query->points(), count,
      [&](const Window& window) {
        return random_point(random_, everything_->entities(), scene_, window.first, window.length_s);
      },
      [&] { return judge(*everything_, query->points(), query->answers(), wanted); });
}

Tally RandomQuestions::ask(RegionQueryOptions wanted, std::size_t count) {
  wanted.capacity = batch;
  const auto query = database().prepare(wanted).value();
  return ask_batches(
      *query, query->regions(), count,
      [&](const Window& window) {
        return random_region(random_, everything_->entities(), scene_, window.first, window.length_s);
      },
      [&] {
        if (wanted.ids_per_region > 0)
          return judge(*everything_, query->regions(), query->answers(), wanted.level);
        return judge(*everything_, query->regions(), counts_as_lists(query->answers()), wanted.level);
      });
}

Tally RandomQuestions::ask(OverlapQueryOptions wanted, std::size_t count) {
  wanted.capacity = batch;
  const auto query = database().prepare(wanted).value();
  return ask_batches(
      *query, query->overlaps(), count, [&](const Window& window) { return random_overlap(window); },
      [&] {
        if (wanted.ids_per_entity > 0) return judge(*everything_, query->overlaps(), query->answers());
        return judge(*everything_, query->overlaps(), counts_as_lists(query->answers()));
      });
}

Overlap RandomQuestions::random_overlap(const Window& window) {
  const auto entities = everything_->entities();
  Overlap overlap;
  overlap.entity = entities[random_.below(entities.size())].id;
  overlap.t = window.first +
              Nanoseconds(static_cast<std::int64_t>(random_.uniform(0.0, 1.0) * window.length_s * 1e9));
  if (random_.one_in(3)) overlap.mask = static_cast<std::uint32_t>(random_.below(16));
  return overlap;
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
