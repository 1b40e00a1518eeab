// The judgement of a pair of concave bodies: agrees with the truth in single precision, and with each fault
// differs.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "surface_scene.hpp"

namespace rtstdb::oracle {
namespace {

constexpr int judged_pairs = 150;
constexpr float judged_margin_m = 0.4f;

struct JudgedCase {
  ContactSearch search;
  SurfacePair pair;
  SurfaceTruth truth;
};

/// Pairs of concave bodies with their truths, which all tests share.
class JudgedScene {
 public:
  JudgedScene() : world_(concave_pairs(940, judged_pairs).world()) {
    for (std::uint32_t i = 0; i < 2 * judged_pairs; i += 2) {
      ContactSearch search = search_of({i, 1}, {i + 1, 1}, judged_margin_m);
      search.t = at_s(0.05);
      const SurfacePair pair(world_, search.first, search.second, search.t);
      cases_.push_back({search, pair, surface_truth(pair)});
    }
  }
  const std::vector<JudgedCase>& cases() const { return cases_; }

 private:
  World world_;
  std::vector<JudgedCase> cases_;
};

/// Calls visit(case, search, answer) for each pair, with the rounded truth.
template <class Visit>
void each_surface_answer(Visit&& visit) {
  static const JudgedScene scene;
  for (const JudgedCase& one : scene.cases()) {
    SCOPED_TRACE(one.search.first.index);
    visit(one, one.search, rounded_surfaces(one.pair, one.truth, one.search));
  }
}

TEST(CompareSurfacePair, AgreesWithTheRoundedTruth) {
  int contacts = 0;
  int near = 0;
  int separate = 0;
  each_surface_answer([&](const JudgedCase& one, const ContactSearch& search, const ContactPair& answer) {
    contacts += answer.status == PairStatus::contact;
    near += answer.status == PairStatus::near;
    separate += answer.status == PairStatus::separate;
    const Judgement judgement = judge_surface_pair(one.pair, one.truth, search, answer);
    EXPECT_EQ(judgement.verdict, Verdict::agrees) << judgement.reason;
  });
  EXPECT_GT(contacts, judged_pairs / 4);
  EXPECT_GT(near, judged_pairs / 10);
  EXPECT_GT(separate, judged_pairs / 20);
}

glm::vec3 across_of(const glm::vec3& n) {
  return glm::normalize(glm::cross(n, std::abs(n.x) < 0.5f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0)));
}

void set_normal(ContactPair& p, const glm::vec3& n) {
  p.n_world = p.points[0].n_world = n;
}

void set_distance(ContactPair& p, float distance_m) {
  p.distance_m = p.min_distance_m = p.max_distance_m = distance_m;
  p.points[0].depth_m = -distance_m;
}

struct SurfaceTampering {
  const char* name;
  PairStatus of;  ///< pairs that are tampered with
  std::function<void(ContactPair&, const JudgedCase&)> with;
};

std::ostream& operator<<(std::ostream& out, const SurfaceTampering& tampering) {
  return out << tampering.name;
}

class CompareTamperedSurfaces : public testing::TestWithParam<SurfaceTampering> {};

TEST_P(CompareTamperedSurfaces, IsRejected) {
  int tried = 0;
  each_surface_answer([&](const JudgedCase& one, const ContactSearch& search, ContactPair answer) {
    // Where the depth or the distance is far above all tolerances.
    if (answer.status != GetParam().of || std::abs(answer.distance_m) < 0.1f) return;
    ++tried;
    GetParam().with(answer, one);
    const Judgement judgement = judge_surface_pair(one.pair, one.truth, search, answer);
    EXPECT_EQ(judgement.verdict, Verdict::differs) << judgement.reason;
    EXPECT_FALSE(judgement.reason.empty());
  });
  EXPECT_GT(tried, 5);
}

constexpr PairStatus in_contact = PairStatus::contact;
using SurfaceAnswer = ContactPair;
using Of = JudgedCase;

INSTANTIATE_TEST_SUITE_P(
    All, CompareTamperedSurfaces,
    testing::Values(
        SurfaceTampering{"contact_missed", in_contact,
                         [](SurfaceAnswer& p, const Of&) {
                           p.status = PairStatus::separate;
                           p.point_count = 0;
                         }},
        SurfaceTampering{"contact_called_near", in_contact,
                         [](SurfaceAnswer& p, const Of&) { p.status = PairStatus::near; }},
        SurfaceTampering{"near_called_contact", PairStatus::near,
                         [](SurfaceAnswer& p, const Of&) { p.status = PairStatus::contact; }},
        SurfaceTampering{"near_called_separate", PairStatus::near,
                         [](SurfaceAnswer& p, const Of&) {
                           p.status = PairStatus::separate;
                           p.point_count = 0;
                         }},
        SurfaceTampering{"separate_called_near", PairStatus::separate,
                         [](SurfaceAnswer& p, const Of&) { p.status = PairStatus::near; }},
        SurfaceTampering{"without_depth", in_contact,
                         [](SurfaceAnswer& p, const Of&) { p.has_depth = false; }},
        SurfaceTampering{"more_depth_than_the_truth", in_contact,
                         [](SurfaceAnswer& p, const Of& one) {
                           set_distance(
                               p, -static_cast<float>(one.truth.max_depth_m + 2.0 * one.truth.precision_m));
                         }},
        SurfaceTampering{"distance_too_long", PairStatus::near,
                         [](SurfaceAnswer& p, const Of& one) {
                           set_distance(p, p.distance_m + 2.0f * static_cast<float>(one.truth.precision_m));
                         }},
        SurfaceTampering{"distance_too_short", PairStatus::near,
                         [](SurfaceAnswer& p, const Of& one) {
                           set_distance(p, p.distance_m - 2.0f * static_cast<float>(one.truth.precision_m));
                         }},
        SurfaceTampering{"distance_nan", in_contact,
                         [](SurfaceAnswer& p, const Of&) { p.distance_m = std::nanf(""); }},
        SurfaceTampering{"bound", in_contact, [](SurfaceAnswer& p, const Of&) { p.min_distance_m -= 0.2f; }},
        SurfaceTampering{"bounds_without_the_distance", PairStatus::near,
                         [](SurfaceAnswer& p, const Of&) { p.max_distance_m -= 0.05f; }},
        SurfaceTampering{"normal_opposite", in_contact,
                         [](SurfaceAnswer& p, const Of&) { set_normal(p, -p.n_world); }},
        SurfaceTampering{"normal_opposite_of_near", PairStatus::near,
                         [](SurfaceAnswer& p, const Of&) { set_normal(p, -p.n_world); }},
        SurfaceTampering{"normal_opposite_of_separate", PairStatus::separate,
                         [](SurfaceAnswer& p, const Of&) { set_normal(p, -p.n_world); }},
        SurfaceTampering{"normal_turned", in_contact,
                         [](SurfaceAnswer& p, const Of&) {
                           set_normal(p, glm::normalize(p.n_world + 0.3f * across_of(p.n_world)));
                         }},
        SurfaceTampering{"normal_turned_of_separate", PairStatus::separate,
                         [](SurfaceAnswer& p, const Of&) {
                           set_normal(p, glm::normalize(p.n_world + 0.5f * across_of(p.n_world)));
                         }},
        SurfaceTampering{"normal_not_unit", in_contact,
                         [](SurfaceAnswer& p, const Of&) { set_normal(p, 1.001f * p.n_world); }},
        SurfaceTampering{"normal_nan", in_contact,
                         [](SurfaceAnswer& p, const Of&) { set_normal(p, glm::vec3(std::nanf(""))); }},
        SurfaceTampering{"normal_of_the_pair_alone", in_contact,
                         [](SurfaceAnswer& p, const Of&) { p.n_world = across_of(p.n_world); }},
        SurfaceTampering{"no_point", in_contact, [](SurfaceAnswer& p, const Of&) { p.point_count = 0; }},
        SurfaceTampering{"five_points", in_contact, [](SurfaceAnswer& p, const Of&) { p.point_count = 5; }},
        SurfaceTampering{"second_point_of_zeros", in_contact,
                         [](SurfaceAnswer& p, const Of&) {
                           p.point_count = 2;
                           p.points[1] = {};
                         }},
        SurfaceTampering{"second_point_deeper", in_contact,
                         [](SurfaceAnswer& p, const Of&) {
                           p.point_count = 2;
                           p.points[1] = p.points[0];
                           p.points[1].depth_m += 0.05f;
                         }},
        SurfaceTampering{"point_along_the_normal", in_contact,
                         [](SurfaceAnswer& p, const Of& one) {
                           p.points[0].p_first_m +=
                               3.0f * static_cast<float>(one.truth.precision_m) * p.n_world;
                         }},
        SurfaceTampering{"point_far_away", in_contact,
                         [](SurfaceAnswer& p, const Of&) { p.points[0].p_first_m += glm::vec3(5.0f); }},
        SurfaceTampering{"point_nan", in_contact,
                         [](SurfaceAnswer& p, const Of&) { p.points[0].p_first_m.x = std::nanf(""); }},
        SurfaceTampering{"no_such_triangle", in_contact,
                         [](SurfaceAnswer& p, const Of&) { p.points[0].second_triangle = 1'000'000; }},
        SurfaceTampering{"bodies_exchanged", in_contact,
                         [](SurfaceAnswer& p, const Of&) {
                           std::swap(p.points[0].first_triangle, p.points[0].second_triangle);
                           set_normal(p, -p.n_world);
                         }},
        SurfaceTampering{"velocity", in_contact,
                         [](SurfaceAnswer& p, const Of&) { p.points[0].v_relative_mps.y += 0.1f; }},
        SurfaceTampering{"undecided_without_the_truth", in_contact,
                         [](SurfaceAnswer& p, const Of&) {
                           p.status = PairStatus::undecided;
                           p.n_world = glm::vec3(0.0f);
                           p.distance_m = p.min_distance_m = p.max_distance_m = 1.0f;
                         }}),
    [](const auto& of_case) { return std::string(of_case.param.name); });

/// A place on the box is 0.15 m beneath the top of the arm, but 0.05 m from its end.
TEST(CompareSurfacePair, RejectsAPointThatHasANearerSurface) {
  const Scene scene =
      two_bodies(test::make_l_shape(2.0, 0.5, 4.0), make_box({0.2, 0.4, 0.2}), {1.85, 0.5, 2.0});
  const World world = scene.world();
  const ContactSearch search = search_of(first_id, second_id);
  const SurfacePair pair(world, first_id, second_id, {});
  const SurfaceTruth truth = surface_truth(pair);
  EXPECT_NEAR(truth.min_depth_m, 0.2, 1e-3);
  ContactPair answer = rounded_surfaces(pair, truth, search);
  ASSERT_EQ(judge_surface_pair(pair, truth, search, answer).verdict, Verdict::agrees);
  EXPECT_NEAR(answer.n_world.y, -1.0f, 1e-6f);
  answer.point_count = 2;
  const auto verdict_with = [&](const glm::dvec3& on_first_m, const glm::dvec3& on_second_m) {
    const double depth_m = glm::distance(on_first_m, on_second_m);
    const glm::dvec3 p_m = 0.5 * (on_first_m + on_second_m);
    answer.points[1] = {.p_first_m = glm::vec3(p_m),
                        .n_world = glm::vec3((on_second_m - on_first_m) / depth_m),
                        .depth_m = static_cast<float>(depth_m),
                        .first_triangle = pair.first_surface.nearest(on_first_m).triangle,
                        .second_triangle = pair.second_surface.nearest(on_second_m).triangle};
    return judge_surface_pair(pair, truth, search, answer).verdict;
  };
  EXPECT_EQ(verdict_with({1.95, 0.5, 2.0}, {1.95, 0.35, 2.0}), Verdict::differs);
  EXPECT_EQ(verdict_with({2.0, 0.35, 2.0}, {1.95, 0.35, 2.0}), Verdict::agrees);
}

/// With the opposite normal and sign, a point has the same places on both surfaces.
TEST(CompareSurfacePair, RejectsAPointThatIsApartWhereTheBodiesPenetrate) {
  const Scene scene = two_bodies(make_sphere(0.5, 3), test::make_bowl(1.0, 0.8, 32), {0.0, 0.0, 0.35});
  const World world = scene.world();
  const ContactSearch search = search_of(first_id, second_id, 0.3f);
  const SurfacePair pair(world, first_id, second_id, {});
  const SurfaceTruth truth = surface_truth(pair);
  ContactPair answer = rounded_surfaces(pair, truth, search);
  ASSERT_EQ(answer.status, PairStatus::contact);
  answer.point_count = 2;
  answer.points[1] = answer.points[0];
  EXPECT_EQ(judge_surface_pair(pair, truth, search, answer).verdict, Verdict::agrees);
  answer.points[1].n_world = -answer.points[0].n_world;
  answer.points[1].depth_m = -answer.points[0].depth_m;
  EXPECT_EQ(judge_surface_pair(pair, truth, search, answer).verdict, Verdict::differs);
}

TEST(CompareSurfacePair, WithoutDepthTakesAnyPointOfTheCrossing) {
  const TriangleMesh sheet = test::make_wavy_sheet(2.0, 0.0, 2);
  const Scene scene =
      two_bodies(sheet, sheet, {0.9, 0.3, 0.2}, glm::angleAxis(0.5 * pi, glm::dvec3(1, 0, 0)));
  const World world = scene.world();
  const ContactSearch search = search_of(first_id, second_id);
  const SurfacePair pair(world, first_id, second_id, {});
  const SurfaceTruth truth = surface_truth(pair);
  const ContactPair right = rounded_surfaces(pair, truth, search);
  const auto verdict_of = [&](const ContactPair& answer) {
    return judge_surface_pair(pair, truth, search, answer).verdict;
  };
  EXPECT_EQ(verdict_of(right), Verdict::agrees);
  ContactPair wrong = right;
  wrong.points[0].p_first_m.y += 0.01f;
  EXPECT_EQ(verdict_of(wrong), Verdict::differs) << "off the second sheet";
  wrong = right;
  set_distance(wrong, -0.01f);
  EXPECT_EQ(verdict_of(wrong), Verdict::differs);
  wrong = right;
  wrong.has_depth = true;
  EXPECT_EQ(verdict_of(wrong), Verdict::differs);
  wrong = right;
  wrong.status = PairStatus::separate;
  wrong.point_count = 0;
  EXPECT_EQ(verdict_of(wrong), Verdict::differs) << "the sheets cross";
}

TEST(CompareSurfacePair, TakesEitherStatusAtTheBorder) {
  const auto judge_at = [](double z_m, PairStatus status) {
    const Scene scene =
        two_bodies(test::make_l_shape(2.0, 0.5, 1.0), make_box({0.2, 0.2, 0.2}), {1.0, 0.2, z_m});
    const World world = scene.world();
    const ContactSearch search = search_of(first_id, second_id, 0.1f);
    const SurfacePair pair(world, first_id, second_id, {});
    const SurfaceTruth truth = surface_truth(pair);
    ContactPair answer = rounded_surfaces(pair, truth, search);
    answer.status = status;
    if (status == PairStatus::contact) set_distance(answer, 0.0f);
    return judge_surface_pair(pair, truth, search, answer).verdict;
  };
  // The box stands 10 micrometres above the shape; its diagonal is 0.35 m.
  EXPECT_EQ(judge_at(1.10001, PairStatus::near), Verdict::agrees);
  EXPECT_EQ(judge_at(1.10001, PairStatus::contact), Verdict::too_close);
  EXPECT_EQ(judge_at(1.10001, PairStatus::separate), Verdict::differs);
  EXPECT_EQ(judge_at(1.11, PairStatus::contact), Verdict::differs);
}

TEST(CompareSurfacePair, TakesASmallerDepthAsTooClose) {
  const auto judge_at = [](float share) {
    const Scene scene =
        two_bodies(test::make_l_shape(2.0, 0.5, 1.0), make_box({0.2, 0.2, 0.2}), {1.0, 0.2, 1.0});
    const World world = scene.world();
    const ContactSearch search = search_of(first_id, second_id, 0.1f);
    const SurfacePair pair(world, first_id, second_id, {});
    const SurfaceTruth truth = surface_truth(pair);
    ContactPair answer = rounded_surfaces(pair, truth, search);
    set_distance(answer, share * answer.distance_m);
    return judge_surface_pair(pair, truth, search, answer).verdict;
  };
  EXPECT_EQ(judge_at(1.0f), Verdict::agrees);
  EXPECT_EQ(judge_at(0.5f), Verdict::too_close);
  EXPECT_EQ(judge_at(-0.5f), Verdict::differs);
}

}  // namespace
}  // namespace rtstdb::oracle
