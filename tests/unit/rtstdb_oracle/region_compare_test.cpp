#include <gtest/gtest.h>

#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

EntityId id(std::uint32_t index) {
  return {index, 1};
}

/// Entities 0 to 4: inside, inside at the border, outside, outside at the border, inside.
std::vector<EntityGap> five_gaps() {
  return {{id(0), -1.0, 1e-4},
          {id(1), -1e-5, 1e-4},
          {id(2), 1.0, 1e-4},
          {id(3), 1e-5, 1e-4},
          {id(4), -2.0, 1e-4}};
}

Verdict verdict_on(const std::vector<EntityId>& ids, std::uint32_t found, bool overflow = false) {
  RegionAnswer answer;
  answer.entities = ids;
  answer.found = found;
  answer.overflow = overflow;
  const auto truth = five_gaps();
  const Judgement judgement = compare(truth, answer);
  EXPECT_EQ(judgement.reason.empty(), judgement.verdict == Verdict::agrees) << judgement.reason;
  return judgement.verdict;
}

TEST(CompareRegion, AgreesWithTheExactAnswer) {
  EXPECT_EQ(verdict_on({id(0), id(1), id(4)}, 3), Verdict::agrees);
}

TEST(CompareRegion, IsTooCloseAtTheBorder) {
  EXPECT_EQ(verdict_on({id(0), id(4)}, 2), Verdict::too_close);
  EXPECT_EQ(verdict_on({id(0), id(1), id(3), id(4)}, 4), Verdict::too_close);
}

TEST(CompareRegion, RejectsWrongAnswers) {
  EXPECT_EQ(verdict_on({id(0), id(1)}, 2), Verdict::differs);                // one missing at the end
  EXPECT_EQ(verdict_on({id(1), id(4)}, 2), Verdict::differs);                // one missing at the front
  EXPECT_EQ(verdict_on({id(0), id(1), id(2), id(4)}, 4), Verdict::differs);  // one too many
  EXPECT_EQ(verdict_on({id(1), id(0), id(4)}, 3), Verdict::differs);         // out of order
  EXPECT_EQ(verdict_on({id(0), id(0), id(1), id(4)}, 4), Verdict::differs);  // twice
  EXPECT_EQ(verdict_on({id(0), id(1), id(4), id(9)}, 4), Verdict::differs);  // unknown
  EXPECT_EQ(verdict_on({id(0), id(1), {4, 2}}, 3), Verdict::differs);        // of another generation
  EXPECT_EQ(verdict_on({id(0), id(1), id(4)}, 4), Verdict::differs);         // miscounted
  EXPECT_EQ(verdict_on({}, 0), Verdict::differs);
}

TEST(CompareRegion, ComparesTheListedEntitiesOfAnOverflow) {
  EXPECT_EQ(verdict_on({id(0), id(1)}, 3, true), Verdict::agrees);
  EXPECT_EQ(verdict_on({id(0)}, 3, true), Verdict::agrees);
  EXPECT_EQ(verdict_on({id(0)}, 2, true), Verdict::too_close);         // the one at the border is not counted
  EXPECT_EQ(verdict_on({id(0), id(4)}, 3, true), Verdict::too_close);  // entity 3 is counted instead
  EXPECT_EQ(verdict_on({id(4)}, 3, true), Verdict::differs);           // not the lowest
  EXPECT_EQ(verdict_on({id(0)}, 5, true), Verdict::differs);           // more than exist
  EXPECT_EQ(verdict_on({id(0)}, 1, true), Verdict::differs);           // no overflow at all
  EXPECT_EQ(verdict_on({id(0), id(1)}, 3, false), Verdict::differs);   // overflow not flagged
}

TEST(CompareRegion, RejectsIncompleteAnswers) {
  RegionAnswer answer;
  answer.incomplete = true;
  EXPECT_EQ(compare(std::span<const EntityGap>{}, answer).verdict, Verdict::differs);
}

TEST(CompareRegion, AgreesWithTheAnswersOfTheOracle) {
  const Scene scene = crowd(9, 60);
  const World world = scene.world();
  Random random(10);
  std::size_t total = 0;
  for (int i = 0; i < 500; ++i) {
    Region region;
    region.shape = i % 2 == 0 ? RegionShape::box : RegionShape::sphere;
    region.test = i % 3 == 0 ? RegionTest::inside : RegionTest::touching;
    region.center_m = glm::vec3(15.0 * random.vector());
    region.half_extent_m = glm::vec3(glm::abs(8.0 * random.vector()));
    region.q = glm::quat(random.orientation());
    region.t = at_s(10.3);
    const auto truth = gaps(world, region);
    const auto ids = found(truth);
    RegionAnswer answer;
    answer.entities = ids;
    answer.found = static_cast<std::uint32_t>(ids.size());
    EXPECT_EQ(compare(truth, answer).verdict, Verdict::agrees);
    total += ids.size();
  }
  EXPECT_GT(total, 200u);
}

}  // namespace
}  // namespace rtstdb::oracle
