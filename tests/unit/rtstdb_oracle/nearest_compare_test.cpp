#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

/// The truth in single precision: the best possible answer.
std::vector<Neighbor> rounded(const World& world, std::span<const NeighborTruth> truth) {
  std::vector<Neighbor> neighbors;
  for (const NeighborTruth& one : truth) {
    const EntityRow& row = world.find(one.entity)->row;
    neighbors.push_back({.entity = one.entity,
                         .mask = row.mask,
                         .material = row.material,
                         .triangle = one.triangle,
                         .distance_m = static_cast<float>(one.distance_m),
                         .u = static_cast<float>(one.u),
                         .v = static_cast<float>(one.v),
                         .has_sign = one.has_sign,
                         .p_world_m = glm::vec3(one.p_world_m),
                         .v_relative_mps = glm::vec3(one.v_relative_mps)});
  }
  return neighbors;
}

Nearest random_point(Random& random) {
  Nearest point;
  point.point_m = glm::vec3(8.0 * random.vector());
  point.t = at_s(random.uniform(10.0, 11.0));
  return point;
}

Verdict verdict_on(const World& world, const Nearest& point, const NearestQueryOptions& options,
                   std::span<const Neighbor> neighbors, bool incomplete = false) {
  const auto truth = nearest(world, point, options);
  const Judgement judgement =
      compare(world, point, options, truth, {.neighbors = neighbors, .incomplete = incomplete});
  EXPECT_EQ(judgement.reason.empty(), judgement.verdict == Verdict::agrees) << judgement.reason;
  return judgement.verdict;
}

TEST(CompareNearest, AgreesWithTheRoundedTruth) {
  const Scene scene = crowd(80, 50);
  const World world = scene.world();
  Random random(81);
  for (int i = 0; i < 400; ++i) {
    const Nearest point = random_point(random);
    const auto target = static_cast<NearestTarget>(i % 4);
    const auto options =
        nearest_options(target, 1u + static_cast<std::uint32_t>(i % 9), target >= NearestTarget::surface);
    const auto neighbors = rounded(world, nearest(world, point, options));
    EXPECT_EQ(verdict_on(world, point, options, neighbors), Verdict::agrees);
  }
}

struct Tampering {
  const char* name;
  std::function<void(std::vector<Neighbor>&)> with;
};

class CompareTamperedNearest : public testing::TestWithParam<Tampering> {};

TEST_P(CompareTamperedNearest, IsRejected) {
  const Scene scene = crowd(82, 50);
  const World world = scene.world();
  Random random(83);
  int tried = 0;
  int rejected = 0;
  for (int i = 0; i < 600; ++i) {
    const Nearest point = random_point(random);
    const auto options =
        nearest_options(i % 2 == 0 ? NearestTarget::surface : NearestTarget::triangle, 5, true);
    auto neighbors = rounded(world, nearest(world, point, options));
    if (glm::length(neighbors[0].v_relative_mps) < 0.1f || std::abs(neighbors[0].distance_m) < 0.01f)
      continue;
    GetParam().with(neighbors);
    ++tried;
    const Verdict verdict = verdict_on(world, point, options, neighbors);
    EXPECT_NE(verdict, Verdict::agrees);
    rejected += verdict == Verdict::differs;
  }
  EXPECT_GT(tried, 200);
  // The others are within the tolerance of a border.
  EXPECT_GT(rejected, tried * 95 / 100);
}

using Neighbors = std::vector<Neighbor>;

INSTANTIATE_TEST_SUITE_P(
    All, CompareTamperedNearest,
    testing::Values(Tampering{"empty", [](Neighbors& n) { n.clear(); }},
                    Tampering{"first_missing_and_last_twice",
                              [](Neighbors& n) {
                                n.erase(n.begin());
                                n.push_back(n.back());
                              }},
                    Tampering{"one_more", [](Neighbors& n) { n.push_back(n.back()); }},
                    Tampering{"distance", [](Neighbors& n) { n[0].distance_m *= 0.95f; }},
                    Tampering{"distance_nan", [](Neighbors& n) { n[0].distance_m = std::nanf(""); }},
                    Tampering{"sign", [](Neighbors& n) { n[0].distance_m *= -1.0f; }},
                    Tampering{"has_sign", [](Neighbors& n) { n[0].has_sign = !n[0].has_sign; }},
                    Tampering{"entity",
                              [](Neighbors& n) { n[0].entity.index = (n[0].entity.index + 1) % 50; }},
                    Tampering{"generation", [](Neighbors& n) { n[0].entity.generation = 7; }},
                    Tampering{"no_such_triangle", [](Neighbors& n) { n[0].triangle += 100'000; }},
                    Tampering{"u", [](Neighbors& n) { n[0].u += 0.01f; }},
                    Tampering{"v", [](Neighbors& n) { n[0].v = std::nanf(""); }},
                    Tampering{"point", [](Neighbors& n) { n[0].p_world_m.y += 0.01f; }},
                    Tampering{"velocity", [](Neighbors& n) { n[0].v_relative_mps *= 1.05f; }},
                    Tampering{"mask", [](Neighbors& n) { n[0].mask ^= 64; }},
                    Tampering{"material", [](Neighbors& n) { n[0].material.index += 1; }}),
    [](const auto& tampering) { return std::string(tampering.param.name); });

class CompareNearestBoxes : public testing::Test {
 protected:
  CompareNearestBoxes() {
    const GeometryId box = scene_.add(make_box({2, 2, 2}));
    for (const double x : {3.0, 6.0, 6.0 + 1e-7, 9.0})
      scene_.place(box, at({x, 0, 0}));
  }
  Neighbors of(std::initializer_list<std::uint32_t> indices) {
    const World world = scene_.world();
    const auto all = rounded(world, nearest(world, {}, nearest_options(NearestTarget::bounds, 9)));
    Neighbors neighbors;
    for (const std::uint32_t index : indices)
      neighbors.push_back(all[index]);
    return neighbors;
  }
  Verdict verdict(const Neighbors& neighbors, float radius_m = 100.0f, bool incomplete = false,
                  std::uint32_t k = 3) {
    Nearest point;
    point.radius_m = radius_m;
    return verdict_on(scene_.world(), point, nearest_options(NearestTarget::bounds, k), neighbors,
                      incomplete);
  }
  Scene scene_;
};

TEST_F(CompareNearestBoxes, ChecksOrderAndCompletenessOfTheList) {
  EXPECT_EQ(verdict(of({0, 1, 2})), Verdict::agrees);
  EXPECT_EQ(verdict(of({0, 1, 2}), 100.0f, true), Verdict::differs) << "incomplete";
  EXPECT_EQ(verdict(of({0, 1, 3})), Verdict::differs) << "a nearer one is missing";
  EXPECT_EQ(verdict(of({0, 1})), Verdict::differs) << "a third one is missing";
  EXPECT_EQ(verdict(of({1, 0, 2})), Verdict::differs) << "out of order";
  EXPECT_EQ(verdict(of({0, 1, 1})), Verdict::differs) << "twice";
  EXPECT_EQ(verdict(of({0, 1, 2, 3})), Verdict::differs) << "too many";
  EXPECT_EQ(verdict(of({0, 2}), 100.0f, false, 2), Verdict::too_close)
      << "1 and 2 are equally far in single precision";
  EXPECT_EQ(verdict(of({0, 1}), 100.0f, false, 2), Verdict::agrees);
}

TEST_F(CompareNearestBoxes, ChecksTheRadius) {
  EXPECT_EQ(verdict(of({0}), 4.9f), Verdict::agrees);
  EXPECT_EQ(verdict(of({0, 1}), 4.9f), Verdict::differs) << "beyond the radius";
  EXPECT_EQ(verdict(of({0}), 5.1f), Verdict::differs) << "one is missing";
  EXPECT_EQ(verdict(of({0, 1}), 5.0f), Verdict::agrees);
  EXPECT_EQ(verdict(of({0, 1, 2}), 5.0f), Verdict::too_close);
  EXPECT_EQ(verdict(of({0}), 5.0f), Verdict::too_close);
  EXPECT_EQ(verdict({}, 1.9f), Verdict::agrees);
}

TEST_F(CompareNearestBoxes, ChecksExclusionAndMask) {
  Nearest point;
  point.excluded = {0, 1};
  const auto options = nearest_options(NearestTarget::bounds, 1);
  EXPECT_EQ(verdict_on(scene_.world(), point, options, of({0})), Verdict::differs);
  EXPECT_EQ(verdict_on(scene_.world(), point, options, of({1})), Verdict::agrees);
  scene_.entities[0].row.mask = 4;
  point = {};
  point.mask = 3;
  Neighbors masked = of({0});
  EXPECT_EQ(verdict_on(scene_.world(), point, options, masked), Verdict::differs);
}

TEST(CompareNearest, ChecksTheTriangleOfASurface) {
  Scene scene;
  scene.place(make_box({2, 2, 2}));
  const World world = scene.world();
  Nearest point;
  point.point_m = {4, 0.2f, 0.3f};
  const auto by_triangle =
      rounded(world, nearest(world, point, nearest_options(NearestTarget::triangle, 12)));
  const auto options = nearest_options(NearestTarget::surface, 1);
  EXPECT_EQ(verdict_on(world, point, options, std::span(by_triangle).first(1)), Verdict::agrees);
  EXPECT_EQ(verdict_on(world, point, options, std::span(by_triangle).subspan(3, 1)), Verdict::differs);
}

}  // namespace
}  // namespace rtstdb::oracle
