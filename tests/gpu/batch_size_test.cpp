// The groups of a dispatch are distributed to the processors of a software device. Neither their number nor
// the size of a batch changes an answer.

#include <algorithm>
#include <map>
#include <vector>

#include "rtstdb/query/dispatch_layout.hpp"
#include "tests/gpu/kind_cases.hpp"
#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

TEST(DispatchLayouts, CoverEachPlaceOnceAndAreNoSlowerThanFullGroups) {
  for (std::uint32_t processors = 0; processors <= 33; ++processors) {
    for (std::uint32_t places = 0; places <= 2500; ++places) {
      SCOPED_TRACE(testing::Message() << places << " places, " << processors << " processors");
      const query::DispatchLayout layout = query::spread_out(places, processors);
      ASSERT_GE(layout.groups * layout.per_group, places);
      ASSERT_TRUE(places == 0 ? layout.groups == 0 : (layout.groups - 1) * layout.per_group < places);
      ASSERT_EQ(layout.per_group % 8, 0u);
      ASSERT_LE(layout.per_group, query::places_per_group);
      const std::uint32_t full = (places + 63) / 64;
      if (processors == 0) {
        ASSERT_EQ(layout.groups, full);
        continue;
      }
      const auto max_places_per_processor = [&](std::uint32_t groups, std::uint32_t per_group) {
        return (groups + processors - 1) / processors * per_group;
      };
      ASSERT_LE(max_places_per_processor(layout.groups, layout.per_group),
                max_places_per_processor(full, 64));
      if (0 < places && places <= 64 * processors) {
        ASSERT_LE(layout.groups, processors);
        ASSERT_LT(layout.per_group, places / processors + 9)
            << "a processor has more than its share and a subgroup";
      }
    }
  }
}

TEST(DispatchLayouts, OfManyPlacesHaveFullGroups) {
  for (std::uint32_t processors = 1; processors <= 33; ++processors)
    EXPECT_EQ(query::spread_out(1'000'000, processors).per_group, 64u) << processors;
}

class BatchSizes : public RandomQueries, public testing::WithParamInterface<std::uint32_t> {
 protected:
  static constexpr std::uint32_t max_size = 200;

  void SetUp() override {
    open({.max_entities = 128}, {.processors = GetParam()});
    fill({.seed = 41, .entities = 60, .radius_m = 6.0});
  }
  std::vector<Words> answers_of(KindCase& query, std::uint32_t size) {
    const Outcome outcome = run(query.query(), size);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    return query.words();
  }
  /// All sizes of a few groups; for expensive queries those around a group of one, two or four subgroups.
  static std::vector<std::uint32_t> sizes(bool few) {
    if (few) return {1, 7, 8, 9, 31, 33, 63, 64, 65, 127, 129};
    std::vector<std::uint32_t> all;
    for (std::uint32_t size = 1; size < max_size; size += size < 72 ? 1 : 13)
      all.push_back(size);
    return all;
  }
  void expect_same_answers_in_every_size(KindCase& query, bool few_sizes = false) {
    SCOPED_TRACE(query.name());
    const std::vector<Words> all = answers_of(query, max_size);
    std::map<Words, std::size_t> repetitions;
    for (const Words& words : all)
      ++repetitions[words];
    for (const auto& [words, count] : repetitions)
      ASSERT_LT(count, 4 * all.size() / 5) << "most answers are equal";
    for (const std::uint32_t size : sizes(few_sizes)) {
      const std::vector<Words> some = answers_of(query, size);
      ASSERT_EQ(some.size(), all.size() / max_size * size);
      for (std::size_t i = 0; i < some.size(); ++i)
        ASSERT_EQ(some[i], all[i]) << "answer " << i << " of " << size << " elements";
    }
  }
};

TEST_P(BatchSizes, DoNotChangeAnswers) {
  const ElementScene elements{oracle_world().entities(), scene(), scene().version_time, 0.5};
  for (const AnyQueryOptions& options : all_tested_options()) {
    const auto query = prepare_case(database(), with(options, max_size));
    query->fill(random(), elements);
    expect_same_answers_in_every_size(*query, is_expensive(options));
  }
  for (const RayMode mode : {RayMode::closest, RayMode::any}) {
    const auto packets =
        prepare_case(database(), RayQueryOptions{.name = "packets", .capacity = max_size, .mode = mode});
    fill_with_neighbours(dynamic_cast<RayQuery&>(packets->query()).rays(), random(), elements.entities,
                         elements.scene, elements.first, elements.window_s);
    expect_same_answers_in_every_size(*packets);
  }
}

INSTANTIATE_TEST_SUITE_P(Processors, BatchSizes, testing::Values(3u, 32u));

}  // namespace
}  // namespace rtstdb::test
