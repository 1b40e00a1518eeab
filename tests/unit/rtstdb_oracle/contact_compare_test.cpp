// The judgement of one pair of a contact answer: agrees with the truth in single precision, and with each
// fault differs.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "contact_scene.hpp"

namespace rtstdb::oracle {
namespace {

/// The verdict on the answer with the pair's normal at each point.
Verdict pair_verdict(const World& world, const ContactSearch& search, ContactPair answer) {
  for (ContactPoint& point : answer.points)
    point.n_world = answer.n_world;
  const PairTruth truth = pair_truth(world, answer.first, answer.second, search.t);
  const Judgement judgement = compare(world, search, truth, answer);
  EXPECT_EQ(judgement.reason.empty(), judgement.verdict == Verdict::agrees) << judgement.reason;
  return judgement.verdict;
}

/// Calls visit(world, search, answer) for pairs of hulls within 2 m or penetrating, each time another two.
template <class Visit>
void each_answer(std::uint64_t seed, std::uint32_t count, double spread_m, Visit&& visit) {
  const Scene scene = hull_crowd(seed, static_cast<int>(2 * count), spread_m);
  const World world = scene.world();
  for (std::uint32_t i = 0; i < 2 * count; i += 2) {
    SCOPED_TRACE(i);
    ContactSearch search = search_of({i, 1}, {}, 2.0f);
    search.t = at_s(10.5);
    const ContactPair answer = rounded(world, search, {i, 1}, {i + 1, 1});
    if (answer.status != PairStatus::separate) visit(world, search, answer);
  }
}

TEST(CompareContactPair, AgreesWithTheRoundedTruth) {
  int contacts = 0;
  int near = 0;
  each_answer(930, 400, 0.9, [&](const World& world, const ContactSearch& search, const ContactPair& answer) {
    ++(answer.status == PairStatus::contact ? contacts : near);
    const PairTruth truth = pair_truth(world, answer.first, answer.second, search.t);
    const Judgement judgement = compare(world, search, truth, answer);
    ASSERT_EQ(judgement.verdict, Verdict::agrees) << judgement.reason;
  });
  EXPECT_GT(contacts, 50);
  EXPECT_GT(near, 100);
}

/// The triangle that is farthest from the point.
std::uint32_t farthest_triangle(const ConvexBody& body, const glm::dvec3& point_m) {
  std::uint32_t best = 0;
  double farthest_m = -1.0;
  for (std::uint32_t i = 0; i < body.triangles_m.size(); ++i) {
    const double off_m = glm::distance(nearest_on_triangle(body.triangles_m[i], point_m).point, point_m);
    if (off_m <= farthest_m) continue;
    farthest_m = off_m;
    best = i;
  }
  return best;
}

void move_point(ContactPoint& point, const PosedPair& pair, const glm::vec3& by_m) {
  point.p_first_m += by_m;
  point.v_relative_mps = relative_velocity_of(pair, glm::dvec3(point.p_first_m));
}

struct PairTampering {
  const char* name;
  std::function<void(ContactPair&, const PosedPair&)> with;
};

class CompareTamperedContact : public testing::TestWithParam<PairTampering> {};

TEST_P(CompareTamperedContact, IsRejected) {
  int tried = 0;
  int rejected = 0;
  each_answer(931, 300, 0.8, [&](const World& world, const ContactSearch& search, ContactPair answer) {
    const PosedPair pair = posed_pair(world, answer.first, answer.second, search.t);
    if (std::abs(answer.distance_m) < 0.1f) return;
    GetParam().with(answer, pair);
    ++tried;
    const Verdict verdict = pair_verdict(world, search, answer);
    EXPECT_NE(verdict, Verdict::agrees);
    rejected += verdict == Verdict::differs;
  });
  EXPECT_GT(tried, 100);
  EXPECT_EQ(rejected, tried);
}

using Pair = ContactPair;

/// A direction across the normal.
glm::vec3 across(const glm::vec3& n) {
  return glm::normalize(glm::cross(n, std::abs(n.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0)));
}

void scale_distance(Pair& p, float by) {
  p.distance_m *= by;
  p.min_distance_m = p.max_distance_m = p.distance_m;
  p.points[0].depth_m = -p.distance_m;
}

INSTANTIATE_TEST_SUITE_P(
    All, CompareTamperedContact,
    testing::Values(
        PairTampering{"status",
                      [](Pair& p, const PosedPair&) {
                        p.status = p.status == PairStatus::contact ? PairStatus::near : PairStatus::contact;
                      }},
        PairTampering{"separate", [](Pair& p, const PosedPair&) { p.status = PairStatus::separate; }},
        PairTampering{"depth_5_percent_less", [](Pair& p, const PosedPair&) { scale_distance(p, 0.95f); }},
        PairTampering{"depth_5_percent_more", [](Pair& p, const PosedPair&) { scale_distance(p, 1.05f); }},
        PairTampering{"distance_nan", [](Pair& p, const PosedPair&) { p.distance_m = std::nanf(""); }},
        PairTampering{"bound", [](Pair& p, const PosedPair&) { p.min_distance_m -= 0.1f; }},
        PairTampering{"bound_nan", [](Pair& p, const PosedPair&) { p.max_distance_m = std::nanf(""); }},
        PairTampering{"normal_3_degrees",
                      [](Pair& p, const PosedPair&) {
                        p.n_world = glm::normalize(p.n_world + 0.0524f * across(p.n_world));
                      }},
        PairTampering{"normal_1_5_degrees",
                      [](Pair& p, const PosedPair&) {
                        p.n_world = glm::normalize(p.n_world + 0.0262f * across(p.n_world));
                      }},
        PairTampering{"normal_opposite", [](Pair& p, const PosedPair&) { p.n_world = -p.n_world; }},
        PairTampering{"normal_not_unit", [](Pair& p, const PosedPair&) { p.n_world *= 1.001f; }},
        PairTampering{"normal_nan", [](Pair& p, const PosedPair&) { p.n_world.y = std::nanf(""); }},
        PairTampering{"no_point", [](Pair& p, const PosedPair&) { p.point_count = 0; }},
        PairTampering{"five_points", [](Pair& p, const PosedPair&) { p.point_count = 5; }},
        PairTampering{
            "point_along_the_normal",
            [](Pair& p, const PosedPair& pair) { move_point(p.points[0], pair, 0.05f * p.n_world); }},
        PairTampering{
            "point_far_across",
            [](Pair& p, const PosedPair& pair) { move_point(p.points[0], pair, 20.0f * across(p.n_world)); }},
        PairTampering{"point_nan",
                      [](Pair& p, const PosedPair&) { p.points[0].p_first_m.z = std::nanf(""); }},
        PairTampering{"point_deeper", [](Pair& p, const PosedPair&) { p.points[0].depth_m += 0.05f; }},
        PairTampering{"second_point_deeper",
                      [](Pair& p, const PosedPair&) {
                        p.point_count = 2;
                        p.points[1] = p.points[0];
                        p.points[1].depth_m += 0.05f;
                      }},
        PairTampering{"second_point_nan",
                      [](Pair& p, const PosedPair&) {
                        p.point_count = 2;
                        p.points[1] = p.points[0];
                        p.points[1].depth_m = std::nanf("");
                      }},
        PairTampering{"no_such_triangle",
                      [](Pair& p, const PosedPair&) { p.points[0].first_triangle += 99; }},
        PairTampering{"velocity", [](Pair& p, const PosedPair&) { p.points[0].v_relative_mps *= 1.05f; }},
        PairTampering{"velocity_nan",
                      [](Pair& p, const PosedPair&) { p.points[0].v_relative_mps.x = std::nanf(""); }}),
    [](const auto& tampering) { return std::string(tampering.param.name); });

TEST(CompareContactPair, RejectsATriangleElsewhere) {
  int tried = 0;
  each_answer(932, 400, 0.9, [&](const World& world, const ContactSearch& search, ContactPair answer) {
    // The triangle may be wrong by the depth: only where it is small, all triangles of the far side are.
    if (std::abs(answer.distance_m) > 0.1f) return;
    const PosedPair pair = posed_pair(world, answer.first, answer.second, search.t);
    const glm::dvec3 p(answer.points[0].p_first_m);
    ContactPair first = answer;
    first.points[0].first_triangle = farthest_triangle(pair.first_body, p);
    ContactPair second = answer;
    second.points[0].second_triangle = farthest_triangle(pair.second_body, p);
    EXPECT_EQ(pair_verdict(world, search, first), Verdict::differs);
    EXPECT_EQ(pair_verdict(world, search, second), Verdict::differs);
    ++tried;
  });
  EXPECT_GT(tried, 10);
}

TEST(CompareContactPair, TakesAnyShortestWayOutOfCoincidentBoxes) {
  const Scene scene = two_bodies(make_box({2, 2, 2}), make_box({2, 2, 2}), {0, 0, 0});
  const World world = scene.world();
  const ContactSearch search = search_of(first_id, second_id);
  ContactPair answer = rounded(world, search, first_id, second_id);
  for (const glm::vec3& n : {glm::vec3(1, 0, 0), glm::vec3(0, -1, 0), glm::vec3(0, 0, 1)}) {
    answer.n_world = n;
    answer.points[0].p_first_m = {0, 0, 0};
    const auto face_of = [&](const ConvexBody& body, const glm::vec3& side) {
      return triangle_at(body, glm::dvec3(side));
    };
    const PosedPair pair = posed_pair(world, first_id, second_id, search.t);
    answer.points[0].first_triangle = face_of(pair.first_body, -n);
    answer.points[0].second_triangle = face_of(pair.second_body, n);
    EXPECT_EQ(pair_verdict(world, search, answer), Verdict::agrees);
  }
  answer.n_world = glm::normalize(glm::vec3(1, 1, 0));
  EXPECT_EQ(pair_verdict(world, search, answer), Verdict::differs) << "this way is longer";
}

TEST(CompareContactPair, RejectsAPointWithAnotherNormal) {
  const Scene scene = two_bodies(make_box({2, 2, 2}), make_box({2, 2, 2}), {0.3, 0.2, 1.9});
  const World world = scene.world();
  const ContactSearch search = search_of(first_id, second_id);
  ContactPair answer = rounded(world, search, first_id, second_id);
  const PairTruth truth = pair_truth(world, first_id, second_id, search.t);
  EXPECT_NE(compare(world, search, truth, answer).verdict, Verdict::differs);
  answer.points[0].n_world *= -1.0f;
  EXPECT_EQ(compare(world, search, truth, answer).verdict, Verdict::differs);
}

/// Where bodies touch, the normal of the truth may be rounding, but a wrong one is still recognized.
TEST(CompareContactPair, RejectsAWrongNormalOfTouchingBoxes) {
  const Scene scene = two_bodies(make_box({2, 2, 2}), make_box({2, 2, 2}), {0.3, 0.2, 2.0});
  const World world = scene.world();
  const ContactSearch search = search_of(first_id, second_id);
  ContactPair answer = rounded(world, search, first_id, second_id);
  answer.n_world = {0, 0, -1};
  EXPECT_NE(pair_verdict(world, search, answer), Verdict::differs);
  answer.n_world = glm::normalize(glm::vec3(0.0524f, 0, -1));
  EXPECT_EQ(pair_verdict(world, search, answer), Verdict::differs) << "3 degrees";
  answer.n_world = {1, 0, 0};
  EXPECT_EQ(pair_verdict(world, search, answer), Verdict::differs);
}

/// A box that is turned a little about y, in a plate: two of its lower corners are deeper than the others.
class CompareContactPlate : public testing::Test {
 protected:
  CompareContactPlate() {
    const glm::dvec3 low_corner_m = turn_ * glm::dvec3(-1, 0, -1);
    scene_ = two_bodies(make_box({20, 20, 1}), make_box({2, 2, 2}), {0, 0, 0.4 - low_corner_m.z}, turn_);
    scene_.entities[1].row.motion.w_world_radps = {0.1, 0.2, 0.3};
  }
  ContactPair answer_at(std::initializer_list<glm::dvec3> corners) const {
    const World world = scene_.world();
    ContactPair answer = rounded(world, search_, first_id, second_id);
    const PosedPair pair = posed_pair(world, first_id, second_id, search_.t);
    answer.point_count = 0;
    for (const glm::dvec3& corner : corners) {
      const glm::dvec3 on_box_m = pair.second.pose.p_world_m + turn_ * corner;
      const glm::dvec3 on_plate_m{on_box_m.x, on_box_m.y, 0.5};
      answer.points[answer.point_count++] =
          contact_between(pair, on_plate_m, on_box_m, on_plate_m.z - on_box_m.z);
    }
    return answer;
  }
  Verdict verdict(const ContactPair& answer) const { return pair_verdict(scene_.world(), search_, answer); }

  glm::dquat turn_ = glm::angleAxis(-0.02, glm::dvec3(0, 1, 0));
  ContactSearch search_ = search_of(first_id, second_id);
  Scene scene_;
};

TEST_F(CompareContactPlate, TakesSeveralPointsWithTheDeepestFirst) {
  const glm::dvec3 deep[] = {{-1, -1, -1}, {-1, 1, -1}};
  const glm::dvec3 shallow[] = {{1, -1, -1}, {1, 1, -1}};
  const ContactPair right = answer_at({deep[0], deep[1], shallow[0], shallow[1]});
  EXPECT_NEAR(right.distance_m, -0.1f, 1e-6f);
  EXPECT_NEAR(right.points[3].depth_m, 0.06f, 1e-3f);
  EXPECT_EQ(verdict(right), Verdict::agrees);
  EXPECT_EQ(verdict(answer_at({deep[1], shallow[0]})), Verdict::agrees);
  EXPECT_EQ(verdict(answer_at({shallow[0], deep[0]})), Verdict::differs);
}

TEST_F(CompareContactPlate, RejectsAPointOnTheFarSideOfABody) {
  // Between the plate and the upper face of the box: they are apart along the normal.
  const ContactPair wrong = answer_at({{-1, -1, -1}, {0, 0, 1}});
  EXPECT_LT(wrong.points[1].depth_m, -1.5f);
  EXPECT_EQ(verdict(wrong), Verdict::differs);
}

TEST_F(CompareContactPlate, RejectsAPointOnOneSurfaceOnly) {
  ContactPair wrong = answer_at({{-1, -1, -1}, {1, -1, -1}});
  wrong.points[1].depth_m -= 0.02f;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "off both surfaces";
  wrong.points[1].p_first_m.z += 0.01f;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "off the surface of the plate";
  wrong.points[1].p_first_m.z -= 0.02f;
  EXPECT_EQ(verdict(wrong), Verdict::differs) << "off the surface of the box";
}

TEST(CompareContactPair, IsTooCloseAtABorder) {
  const auto verdict = [](double apart_m, PairStatus status, float margin_m, bool is_named = true) {
    const Scene scene = two_bodies(make_box({2, 2, 2}), make_box({2, 2, 2}), {0.3, 0.2, 2.0 + apart_m});
    const ContactSearch search = search_of(first_id, is_named ? second_id : EntityId{}, margin_m);
    ContactPair answer = rounded(scene.world(), search, first_id, second_id);
    answer.status = status;
    answer.point_count = status == PairStatus::separate ? 0 : 1;
    return pair_verdict(scene.world(), search, answer);
  };
  // precision_m is about 0.07 mm.
  EXPECT_EQ(verdict(0.00004, PairStatus::contact, 0.0f), Verdict::too_close);
  EXPECT_EQ(verdict(0.00004, PairStatus::separate, 0.0f), Verdict::agrees);
  EXPECT_EQ(verdict(0.001, PairStatus::contact, 0.0f), Verdict::differs);
  EXPECT_EQ(verdict(-0.00004, PairStatus::separate, 0.0f), Verdict::too_close);
  EXPECT_EQ(verdict(-0.001, PairStatus::separate, 0.0f), Verdict::differs);
  EXPECT_EQ(verdict(0.50004, PairStatus::near, 0.5f), Verdict::too_close);
  EXPECT_EQ(verdict(0.49996, PairStatus::separate, 0.5f), Verdict::too_close);
  EXPECT_EQ(verdict(0.501, PairStatus::near, 0.5f), Verdict::differs);
  EXPECT_EQ(verdict(0.499, PairStatus::separate, 0.5f), Verdict::differs);
  EXPECT_EQ(verdict(0.501, PairStatus::separate, 0.5f), Verdict::agrees);
  EXPECT_EQ(verdict(0.501, PairStatus::separate, 0.5f, false), Verdict::differs) << "not a named pair";
  EXPECT_EQ(verdict(0.49996, PairStatus::separate, 0.5f, false), Verdict::differs) << "not a named pair";
}

TEST(CompareContactPair, ChecksTheBoundsOfAnUndecidedPair) {
  const Scene scene = two_bodies(make_box({2, 2, 2}), make_box({2, 2, 2}), {0.3, 0.2, 3.0});
  const auto verdict = [&](float min_m, float distance_m, float max_m, const glm::vec3& n = glm::vec3(0.0f)) {
    ContactPair answer;
    answer.first = first_id;
    answer.second = second_id;
    answer.status = PairStatus::undecided;
    answer.min_distance_m = min_m;
    answer.distance_m = distance_m;
    answer.max_distance_m = max_m;
    answer.n_world = n;
    return pair_verdict(scene.world(), search_of(first_id, second_id), answer);
  };
  EXPECT_EQ(verdict(0.9f, 0.9f, 1.2f), Verdict::too_close);
  EXPECT_EQ(verdict(1.1f, 1.1f, 1.2f), Verdict::differs);
  EXPECT_EQ(verdict(0.8f, 0.9f, 0.9f), Verdict::differs);
  EXPECT_EQ(verdict(0.9f, 1.3f, 1.2f), Verdict::differs);
  EXPECT_EQ(verdict(std::nanf(""), 0.9f, 1.2f), Verdict::differs);
  EXPECT_EQ(verdict(0.9f, 0.9f, 1.2f, {0, 0, 1}), Verdict::differs);
}

}  // namespace
}  // namespace rtstdb::oracle
