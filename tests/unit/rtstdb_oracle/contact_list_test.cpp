// The judgement of the list of pairs of a contact answer.

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "rtstdb/oracle/judge.hpp"
#include "surface_scene.hpp"

namespace rtstdb::oracle {
namespace {

ContactQueryOptions contact_options(std::uint32_t pairs_per_search = 64, std::uint32_t max_candidates = 0) {
  return {
      .name = "test", .capacity = 1, .pairs_per_search = pairs_per_search, .max_candidates = max_candidates};
}

/// An answer with its pairs.
struct OwnedAnswer {
  std::vector<ContactPair> pairs;
  std::uint32_t found = 0;
  std::uint32_t candidates = 0;
  bool overflow = false;
  bool incomplete = false;
};

/// The truth of the search in single precision.
OwnedAnswer rounded_answer(const World& world, const ContactSearch& search,
                           const ContactQueryOptions& options) {
  OwnedAnswer answer;
  for (const ContactCandidate& candidate : contact_candidates(world, search)) {
    const bool is_named = search.second.valid();
    if (candidate.gap_m > 0.0 && !is_named) continue;
    ++answer.candidates;
    ContactPair pair;
    if (is_surface_pair(world, candidate.first, candidate.second)) {
      const SurfacePair surfaces(world, candidate.first, candidate.second, search.t);
      pair = rounded_surfaces(surfaces, surface_truth(surfaces), search);
    } else {
      pair = rounded(world, search, candidate.first, candidate.second);
    }
    if (pair.status == PairStatus::separate && !is_named) continue;
    ++answer.found;
    if (answer.pairs.size() < options.pairs_per_search) answer.pairs.push_back(pair);
  }
  answer.overflow = answer.found > answer.pairs.size();
  return answer;
}

Judgement judged_answer(const World& world, const ContactSearch& search, const ContactQueryOptions& options,
                        const OwnedAnswer& owned) {
  const ContactAnswer answer{.pairs = owned.pairs,
                             .found = owned.found,
                             .candidates = owned.candidates,
                             .overflow = owned.overflow,
                             .incomplete = owned.incomplete};
  Judgement judgement = judge(world, search, {&answer, 1}, options);
  EXPECT_EQ(judgement.reason.empty(), judgement.verdict == Verdict::agrees) << judgement.reason;
  return judgement;
}

TEST(CompareContactList, AgreesWithTheRoundedTruth) {
  const Scene scene = hull_crowd(940, 60, 3.0);
  const World world = scene.world();
  Random random(941);
  std::size_t listed = 0;
  for (int i = 0; i < 60; ++i) {
    ContactSearch search;
    search.t = at_s(random.uniform(10.0, 11.0));
    search.margin_m = static_cast<float>(i % 3 == 0 ? 0.0 : random.magnitude(0.01, 1.0));
    if (i % 4 != 0) search.first = scene.entities[random.below(60)].id;
    if (i % 4 == 1) search.second = scene.entities[random.below(60)].id;
    if (search.first == search.second) search.second = {};
    if (i % 5 == 0) search.second_mask = 3;
    if (i % 7 == 0) search.first_mask = 5;
    const ContactQueryOptions options = contact_options(i % 6 == 0 ? 8 : 1000);
    const OwnedAnswer answer = rounded_answer(world, search, options);
    listed += answer.pairs.size();
    const Judgement judgement = judged_answer(world, search, options, answer);
    ASSERT_EQ(judgement.verdict, Verdict::agrees) << "search " << i << ": " << judgement.reason;
  }
  EXPECT_GT(listed, 200u);
}

TEST(CompareContactList, AgreesWithTheRoundedTruthOfConcaveBodies) {
  Scene scene = concave_pairs(942, 20);
  Random random(943);
  for (EntityState& state : scene.entities)
    state.row.motion.p_world_m = 2.5 * random.vector();
  const World world = scene.world();
  std::size_t listed = 0;
  for (int i = 0; i < 24; ++i) {
    ContactSearch search;
    search.t = at_s(random.uniform(0.0, 0.2));
    search.margin_m = static_cast<float>(i % 3 == 0 ? 0.0 : random.magnitude(0.01, 1.0));
    if (i % 4 != 0) search.first = scene.entities[random.below(40)].id;
    const ContactQueryOptions options = contact_options(i % 6 == 0 ? 8 : 1000);
    const OwnedAnswer answer = rounded_answer(world, search, options);
    listed += answer.pairs.size();
    const Judgement judgement = judged_answer(world, search, options, answer);
    ASSERT_EQ(judgement.verdict, Verdict::agrees) << "search " << i << ": " << judgement.reason;
  }
  EXPECT_GT(listed, 50u);
}

/// Entity 0 penetrates 1, 2 and 3; 4 is within 0.5 m of it, and 5 is 3 m away, with its bounds near it.
class CompareContactBoxes : public testing::Test {
 protected:
  CompareContactBoxes() {
    const GeometryId box = scene_.add(make_box({2, 2, 2}));
    for (const glm::dvec3& p : {glm::dvec3(0, 0, 0), glm::dvec3(1.9, 0.1, 0), glm::dvec3(0.2, 1.8, 0.1),
                                glm::dvec3(0, 0.3, -1.7), glm::dvec3(0.1, 0.2, 2.25)})
      scene_.place(box, at(p));
    scene_.place(box, at({5, 0, 0}));
    search_ = search_of(first_id, {}, 0.5f);
  }
  OwnedAnswer answer(const ContactQueryOptions& options = contact_options()) const {
    return rounded_answer(scene_.world(), search_, options);
  }
  Verdict verdict(const OwnedAnswer& answer, const ContactQueryOptions& options = contact_options()) const {
    return judged_answer(scene_.world(), search_, options, answer).verdict;
  }
  Scene scene_;
  ContactSearch search_;
};

TEST_F(CompareContactBoxes, ChecksWhichPairsAreListed) {
  const OwnedAnswer right = answer();
  ASSERT_EQ(right.pairs.size(), 4u);
  EXPECT_EQ(right.candidates, 4u);
  EXPECT_EQ(verdict(right), Verdict::agrees);

  OwnedAnswer wrong = right;
  std::swap(wrong.pairs[1], wrong.pairs[2]);
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "out of order";

  wrong = right;
  wrong.pairs.erase(wrong.pairs.begin() + 1);
  wrong.found = 3;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "one is missing";

  wrong = right;
  wrong.pairs.pop_back();
  wrong.found = 3;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "the last one is missing";

  wrong = right;
  wrong.pairs.push_back(rounded(scene_.world(), search_, first_id, {5, 1}));
  wrong.found = 5;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "one is too far away";

  wrong = right;
  wrong.pairs.insert(wrong.pairs.begin(), wrong.pairs[0]);
  wrong.found = 5;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "one is listed twice";

  wrong = right;
  wrong.pairs[0].second.generation = 2;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "an earlier entity";

  wrong = right;
  std::swap(wrong.pairs[0].first, wrong.pairs[0].second);
  wrong.pairs[0].n_world *= -1.0f;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "the named entity is the first one";

  wrong = right;
  wrong.pairs[2].distance_m *= 1.05f;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "a wrong pair";

  wrong = right;
  wrong.incomplete = true;
  EXPECT_EQ(verdict(wrong), Verdict::differs);
}

TEST_F(CompareContactBoxes, ChecksTheNumbers) {
  const OwnedAnswer right = answer();
  OwnedAnswer wrong = right;
  wrong.found = 3;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "fewer found than listed";
  wrong.found = 5;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "more found than listed";
  wrong = right;
  wrong.candidates = 3;
  EXPECT_EQ(verdict(wrong), Verdict::differs);
  wrong.candidates = 5;
  EXPECT_EQ(verdict(wrong), Verdict::differs);
  wrong = right;
  wrong.overflow = true;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "overflow of nothing";
}

TEST_F(CompareContactBoxes, TakesTheBeginningOfAListThatOverflows) {
  const ContactQueryOptions options = contact_options(2, 64);
  const OwnedAnswer right = answer(options);
  ASSERT_TRUE(right.overflow);
  EXPECT_EQ(right.found, 4u);
  EXPECT_EQ(verdict(right, options), Verdict::agrees);
  OwnedAnswer wrong = right;
  wrong.found = 3;
  EXPECT_EQ(verdict(wrong, options), Verdict::differs) << "found too small";
  wrong.found = 5;
  EXPECT_EQ(verdict(wrong, options), Verdict::differs) << "found too large";
  wrong = right;
  wrong.overflow = false;
  EXPECT_EQ(verdict(wrong, options), Verdict::differs);
  wrong = right;
  wrong.pairs.pop_back();
  EXPECT_EQ(verdict(wrong, options), Verdict::differs) << "fewer listed than fit";
  wrong = right;
  wrong.pairs[1] = rounded(scene_.world(), search_, first_id, {3, 1});
  EXPECT_EQ(verdict(wrong, options), Verdict::differs) << "not the beginning";
}

TEST_F(CompareContactBoxes, TakesTheFirstCandidatesWhereTheyOverflow) {
  const ContactQueryOptions options = contact_options(64, 2);
  OwnedAnswer tested = answer();
  tested.pairs.resize(2);
  tested.found = 2;
  tested.overflow = true;
  EXPECT_EQ(verdict(tested, options), Verdict::agrees);
  EXPECT_EQ(verdict(tested, contact_options(64, 4)), Verdict::differs) << "all of them fit";
  tested.overflow = false;
  EXPECT_EQ(verdict(tested, options), Verdict::differs);
}

TEST_F(CompareContactBoxes, TakesTheFirstBodiesWhereTheyOverflow) {
  search_.first = {};
  ContactQueryOptions options = contact_options(64, 64);
  options.max_bodies = 2;
  OwnedAnswer tested = answer();
  ASSERT_GT(tested.candidates, 5u);
  tested.pairs.resize(3);
  tested.found = 3;
  tested.candidates = 3;
  tested.overflow = true;
  EXPECT_EQ(verdict(tested, options), Verdict::agrees);
  options.max_bodies = 6;
  EXPECT_EQ(verdict(tested, options), Verdict::differs) << "all of them fit";
}

TEST_F(CompareContactBoxes, JudgesBodiesThatAreNotConvexByTheirSurfaces) {
  TriangleMesh open = make_box({2, 2, 2});
  open.triangles.pop_back();
  scene_.place(open, at({-1.9, 0, 0}));
  const OwnedAnswer right = answer();
  ASSERT_EQ(right.pairs.size(), 5u);
  EXPECT_EQ(right.pairs[4].status, PairStatus::contact);
  EXPECT_EQ(verdict(right), Verdict::agrees);
  OwnedAnswer wrong = right;
  wrong.pairs[4].status = PairStatus::near;
  EXPECT_EQ(verdict(wrong), Verdict::differs);
  wrong = right;
  wrong.pairs[4].has_depth = false;
  EXPECT_EQ(verdict(wrong), Verdict::differs);
  wrong = right;
  wrong.pairs[0].has_depth = false;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "this one is convex";
  wrong = right;
  wrong.pairs.pop_back();
  wrong.found = 4;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "a contact is missing";
  scene_.entities.back().row.motion.p_world_m.x = -9.0;
  EXPECT_EQ(verdict(right), Verdict::differs) << "it is no candidate";
  EXPECT_EQ(verdict(answer()), Verdict::agrees);
}

TEST_F(CompareContactBoxes, AdmitsEitherListAtTheBorder) {
  // Entity 4 is at the margin within noise.
  scene_.entities[4].row.motion.p_world_m.z = 2.500005;
  OwnedAnswer listed = answer();
  ASSERT_EQ(listed.pairs.size(), 3u);
  EXPECT_EQ(verdict(listed), Verdict::agrees);
  ContactPair near = rounded(scene_.world(), search_, first_id, {4, 1});
  near.status = PairStatus::near;
  near.point_count = 1;
  listed.pairs.push_back(near);
  listed.found = 4;
  EXPECT_EQ(verdict(listed), Verdict::too_close);
  listed.pairs.back().second.index = 9;
  EXPECT_EQ(verdict(listed), Verdict::differs) << "an unknown entity in its place";
  scene_.entities[4].row.motion.p_world_m.z = 2.499995;
  EXPECT_EQ(verdict(answer()), Verdict::agrees);
  OwnedAnswer without = answer();
  without.pairs.pop_back();
  without.found = 3;
  EXPECT_EQ(verdict(without), Verdict::too_close);
}

TEST_F(CompareContactBoxes, CountsAnUndecidedPairAsTooClose) {
  OwnedAnswer undecided = answer();
  ContactPair& pair = undecided.pairs[2];
  pair.status = PairStatus::undecided;
  pair.n_world = {0, 0, 0};
  pair.min_distance_m -= 0.1f;
  pair.point_count = 0;
  EXPECT_EQ(verdict(undecided), Verdict::too_close);
  pair.min_distance_m = pair.distance_m = pair.max_distance_m = -0.5f;
  EXPECT_EQ(verdict(undecided), Verdict::differs);
}

TEST_F(CompareContactBoxes, ListsANamedPairAtAnyDistance) {
  search_.second = {5, 1};
  const OwnedAnswer right = answer();
  ASSERT_EQ(right.pairs.size(), 1u);
  EXPECT_EQ(right.pairs[0].status, PairStatus::separate);
  EXPECT_EQ(verdict(right), Verdict::agrees);
  OwnedAnswer wrong = right;
  wrong.candidates = 0;
  EXPECT_EQ(verdict(wrong), Verdict::agrees) << "its bounds do not overlap";
  wrong.pairs.clear();
  wrong.found = 0;
  EXPECT_EQ(verdict(wrong), Verdict::differs);
}

TEST_F(CompareContactBoxes, OfAllPairsHaveTheLowerIndexFirst) {
  search_.first = {};
  const OwnedAnswer right = answer();
  EXPECT_GT(right.pairs.size(), 4u);
  EXPECT_EQ(verdict(right), Verdict::agrees);
  OwnedAnswer wrong = right;
  std::swap(wrong.pairs[1].first, wrong.pairs[1].second);
  EXPECT_EQ(verdict(wrong), Verdict::differs);
  wrong = right;
  std::swap(wrong.pairs[3], wrong.pairs[4]);
  EXPECT_EQ(verdict(wrong), Verdict::differs);
}

}  // namespace
}  // namespace rtstdb::oracle
