// Worlds that change in every way from version to version: few rows, many, all; entities that are created and
// removed, down to one; geometry that is taken away and given. Whether the tree of a version is patched,
// renewed, refitted or built, the answers agree with the oracle.

#include <algorithm>
#include <cmath>
#include <ostream>
#include <string>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

struct Case {
  const char* name;
  std::uint64_t seed;
  std::uint32_t max_entities;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

class ChangingWorlds : public DatabaseTest, public testing::WithParamInterface<Case> {
 protected:
  static constexpr std::uint32_t max_elements = 200;

  void SetUp() override {
    open({.max_entities = 4096});
    for (const TriangleMesh& mesh : mixed_meshes(random_))
      geometries_.push_back(add(mesh));
    lists_ = prepare(RegionQueryOptions{.name = "lists", .capacity = max_elements, .ids_per_region = 4096});
    counts_ = prepare(RegionQueryOptions{.name = "counts", .capacity = max_elements, .ids_per_region = 0});
    any_ = prepare_rays(RayMode::any, false, max_elements);
    closest_ = prepare_rays(RayMode::closest, false, max_elements);
  }

  /// One in 300 is so far away that the upper words of the Morton codes of the others are nearly equal.
  EntityRow any_row() {
    EntityRow row = random_row(random_, geometries_, scene_, rows_);
    if (random_.one_in(300)) row.motion.p_world_m = glm::dvec3(9e4);
    return row;
  }

  void create_one(Transaction& transaction) {
    rows_.push_back(any_row());
    transaction.create(rows_.back());
  }

  /// Changes each entity with the probability 1 / `share`.
  void change_some(Transaction& transaction, std::size_t share) {
    for (const EntityState& entity : entities_) {
      if (!random_.one_in(share)) continue;
      EntityRow row = any_row();
      if (random_.one_in(20)) row.geometry = {};
      transaction.update(entity.id, row);
    }
  }

  void remove_all_but(Transaction& transaction, std::size_t kept) {
    std::vector<EntityState> all = entities_;
    std::ranges::shuffle(all, random_.engine);
    for (std::size_t i = kept; i < all.size(); ++i)
      transaction.remove(all[i].id);
  }

  /// Commits the next version, 1 to 50 ms after the last.
  void change(int version) {
    scene_.version_time += Nanoseconds(1'000'000 * static_cast<std::int64_t>(1 + random_.below(50)));
    const Outcome outcome = execute(
        [&](Transaction& transaction) {
          const std::size_t count = entities_.size();
          if (version % 12 == 6) return remove_all_but(transaction, version % 24 == 6 ? 1 : (count + 1) / 2);
          if (version % 12 == 0 || version % 12 == 8) {
            for (std::size_t i = count; i < GetParam().max_entities; ++i)
              create_one(transaction);
            return;
          }
          if (version % 12 == 7) return create_one(transaction);
          constexpr std::size_t shares[] = {1000, 1000, 50, 10, 3, 1};
          change_some(transaction, shares[random_.below(std::size(shares))]);
        },
        scene_.version_time);
    ASSERT_TRUE(outcome.done()) << describe(outcome);
    entities_ = database().snapshot({}).value();
    world_ = world_ ? world_->with_entities(entities_, scene_.version_time) : this->world();
  }

  void run_queries(int version) {
    const std::uint32_t count = random_.one_in(2) ? max_elements : 24;
    constexpr double windows_s[] = {0.0, 0.001, 0.3};
    const double window_s = windows_s[random_.below(std::size(windows_s))];
    std::vector<Region> regions(count);
    for (Region& region : regions)
      region = random_region(random_, entities_, scene_, scene_.version_time, window_s);
    std::vector<Ray> rays(count);
    for (Ray& ray : rays)
      ray = random_ray(random_, entities_, scene_, scene_.version_time, window_s);
    if (version % 3 == 0)
      fill_with_neighbours(rays, random_, entities_, scene_, scene_.version_time, window_s);
    std::ranges::copy(regions, lists_->regions().begin());
    std::ranges::copy(regions, counts_->regions().begin());
    std::ranges::copy(rays, any_->rays().begin());
    std::ranges::copy(rays, closest_->rays().begin());
    const Outcome outcome = execute([&](Transaction& transaction) {
      transaction.add_query(*lists_, count);
      transaction.add_query(*counts_, count);
      transaction.add_query(*any_, count);
      transaction.add_query(*closest_, count);
    });
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    const auto answers = lists_->answers().first(count);
    found_ += judge(*world_, regions, answers);
    hits_ += judge(*world_, rays, closest_->hits().first(count));
    for (std::uint32_t i = 0; i < count; ++i) {
      ASSERT_EQ(counts_->answers()[i].found, answers[i].found) << "region " << i;
      ASSERT_EQ(any_->hits()[i].status, closest_->hits()[i].status) << "ray " << i;
    }
  }

  Random random_{GetParam().seed};
  SceneOptions scene_{.radius_m = 2.0 * std::cbrt(static_cast<double>(GetParam().max_entities)),
                      .version_time = at_s(1.0)};
  std::vector<GeometryId> geometries_;
  std::vector<EntityRow> rows_;
  std::vector<EntityState> entities_;
  std::optional<oracle::World> world_;
  std::unique_ptr<RegionQuery> lists_, counts_;
  std::unique_ptr<RayQuery> any_, closest_;
  Tally found_, hits_;
};

TEST_P(ChangingWorlds, AnswerAsTheOracleInEveryVersion) {
  for (int version = 0; version < 36 && !HasFailure(); ++version) {
    SCOPED_TRACE("version " + std::to_string(version));
    change(version);
    if (!HasFailure()) run_queries(version);
  }
  for (const Tally& tally : {found_, hits_}) {
    EXPECT_GT(tally.hits, tally.elements / 10);
    EXPECT_LT(tally.hits, tally.elements);
    EXPECT_LE(tally.too_close, tally.elements / 100);
  }
}

INSTANTIATE_TEST_SUITE_P(Sizes, ChangingWorlds,
                         testing::Values(Case{"two", 41, 2}, Case{"nine", 42, 9}, Case{"forty", 43, 40},
                                         Case{"six_hundred", 44, 600}, Case{"large_build", 45, 2300}),
                         [](const auto& test_case) { return std::string(test_case.param.name); });

}  // namespace
}  // namespace rtstdb::test
