// Batches of every size are shared out to as many processors as a software device may have, and each element
// gets the answer that it gets in a batch of many.

#include <algorithm>
#include <cstdlib>
#include <map>
#include <string>

#include "rtstdb/open_database.hpp"
#include "rtstdb/query/dispatch_layout.hpp"
#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

TEST(SpreadOut, CoversEachPlaceOnceAndIsNoSlowerThanFullGroups) {
  for (std::uint32_t processors = 0; processors <= 33; ++processors) {
    for (std::uint32_t places = 0; places <= 2500; ++places) {
      SCOPED_TRACE(testing::Message() << places << " places, " << processors << " processors");
      const query::DispatchLayout spread = query::spread_out(places, processors);
      ASSERT_GE(spread.groups * spread.per_group, places);
      ASSERT_TRUE(places == 0 ? spread.groups == 0 : (spread.groups - 1) * spread.per_group < places);
      ASSERT_EQ(spread.per_group % 8, 0u);
      ASSERT_LE(spread.per_group, query::places_per_group);
      const std::uint32_t full = (places + 63) / 64;
      if (processors == 0) {
        ASSERT_EQ(spread.groups, full);
        continue;
      }
      const auto of_the_busiest = [&](std::uint32_t groups, std::uint32_t per_group) {
        return (groups + processors - 1) / processors * per_group;
      };
      ASSERT_LE(of_the_busiest(spread.groups, spread.per_group), of_the_busiest(full, 64));
      if (0 < places && places <= 64 * processors) {
        ASSERT_LE(spread.groups, processors);
        ASSERT_LT(spread.per_group, places / processors + 9)
            << "one has more to do than its share and a subgroup";
      }
    }
  }
}

TEST(SpreadOut, ManyFillTheirGroups) {
  for (std::uint32_t processors = 1; processors <= 33; ++processors)
    EXPECT_EQ(query::spread_out(1'000'000, processors).per_group, 64u) << processors;
}

class BatchSizes : public testing::TestWithParam<std::uint32_t> {
 protected:
  static constexpr std::uint32_t most = 200;

  void SetUp() override {
    DatabaseOptions options;
    options.max_entities = 64;
    options.validation = Validation::on;
    if (const char* select = std::getenv("HIL_TEST_GPU")) options.gpu = select;
    gpu::DeviceOptions device_options;
    device_options.processors = GetParam();
    device_options.shared = true;
    database_ = open_database(options, device_options).value();
    for (const TriangleMesh& mesh : mixed_meshes(random_))
      geometries_.push_back(database_->add_geometry(mesh, "mesh").value());
    const auto transaction = database_->make_transaction({.max_writes = 60});
    transaction->begin({});
    for (int i = 0; i < 60; ++i)
      transaction->create(random_row(random_, geometries_, scene_, {}));
    ASSERT_TRUE(database_->execute(*transaction).done());
    entities_ = database_->snapshot({}).value();
    asking_ = database_->make_transaction({.max_queries = 1});
  }
  void TearDown() override { EXPECT_EQ(database_->health().validation_messages, std::vector<std::string>{}); }

  template <class AQuery>
  void ask(AQuery& query, std::uint32_t count) {
    asking_->begin({});
    asking_->add_query(query, count);
    const Outcome& outcome = database_->execute(*asking_);
    ASSERT_TRUE(outcome.status == Status::committed || outcome.truncated) << describe(outcome);
  }

  /// `words_of(i)`: what the query answers to its element i.
  template <class AQuery, class WordsOf>
  void expect_the_same_answers(AQuery& query, WordsOf words_of) {
    ask(query, most);
    std::vector<std::string> whole;
    for (std::uint32_t i = 0; i < most; ++i)
      whole.push_back(words_of(i));
    std::map<std::string, std::uint32_t> times;
    for (const std::string& words : whole)
      ++times[words];
    for (const auto& [words, count] : times)
      ASSERT_LT(count, 4 * most / 5) << "answers tell too little apart";
    for (std::uint32_t count = 1; count < most; count += count < 72 ? 1 : 13) {
      ask(query, count);
      for (std::uint32_t i = 0; i < count; ++i)
        ASSERT_EQ(words_of(i), whole[i]) << "element " << i << " of " << count;
    }
  }

  template <class T>
  static std::string bytes_of(const T& one) {
    return {reinterpret_cast<const char*>(&one), sizeof one};
  }

  Random random_{41};
  SceneOptions scene_{.radius_m = 6.0};
  std::unique_ptr<Database> database_;
  std::vector<GeometryId> geometries_;
  std::vector<EntityState> entities_;
  std::unique_ptr<Transaction> asking_;
};

TEST_P(BatchSizes, OfRays) {
  for (const bool side_by_side : {false, true}) {
    for (const RayMode mode : {RayMode::closest, RayMode::any}) {
      const auto query =
          database_->prepare(RayQueryOptions{.name = "rays", .capacity = most, .mode = mode}).value();
      const std::span<Ray> asked = query->rays();
      for (std::size_t i = 0; i < most; i += 8) {
        std::ranges::copy(random_neighbours(random_, entities_, scene_, {}, 0.5), asked.begin() + i);
        for (std::size_t k = 0; k < 8 && !side_by_side; ++k)
          asked[i + k] = random_ray(random_, entities_, scene_, {}, 0.5);
      }
      expect_the_same_answers(*query, [&](std::uint32_t i) { return bytes_of(query->hits()[i]); });
    }
  }
}

TEST_P(BatchSizes, OfPoints) {
  for (const NearestQueryOptions& options :
       {NearestQueryOptions{.name = "centres", .capacity = most, .target = NearestTarget::center, .k = 3},
        NearestQueryOptions{.name = "triangles",
        .capacity = most,
        .target = NearestTarget::triangle,
        .k = 3,
        .is_signed = true}}) {
    const auto query = database_->prepare(options).value();
    for (Nearest& point : query->points())
      point = random_point(random_, entities_, scene_, {}, 0.5);
    expect_the_same_answers(*query, [&](std::uint32_t i) {
      std::string words;
      for (const Neighbor& neighbor : query->answers()[i].neighbors)
        words += bytes_of(neighbor);
      return words;
    });
  }
}

TEST_P(BatchSizes, OfRegions) {
  for (const RegionLevel level : {RegionLevel::bounds, RegionLevel::triangle}) {
    const auto query = database_
                           ->prepare(RegionQueryOptions{
                               .name = "regions", .capacity = most, .level = level, .ids_per_region = 4})
                           .value();
    bool overflow = false;
    for (Region& region : query->regions())
      region = random_region(random_, entities_, scene_, {}, 0.5);
    expect_the_same_answers(*query, [&](std::uint32_t i) {
      const RegionAnswer& answer = query->answers()[i];
      overflow = overflow || answer.overflow;
      std::string words = std::to_string(answer.found);
      for (const EntityId id : answer.entities)
        words += " " + std::to_string(id.index);
      for (const EntityTriangle& one : answer.triangles)
        words += " " + std::to_string(one.entity.index) + "/" + std::to_string(one.triangle);
      return words;
    });
    EXPECT_TRUE(overflow) << "the search for the lowest ids was not asked";
  }
}

INSTANTIATE_TEST_SUITE_P(Processors, BatchSizes, testing::Values(1u, 2u, 3u, 7u, 32u));

}  // namespace
}  // namespace rtstdb::test
