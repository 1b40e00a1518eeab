// Contacts of random hulls: against loops over everything, and by what defines a distance and a depth. Which
// meshes are convex, and which pairs a search admits.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include <rtstdb/limits.hpp>

#include "contact_scene.hpp"

namespace rtstdb::oracle {
namespace {

/// The gap along the axis, from all corners of all triangles.
double full_gap_m(const ConvexBody& first, const ConvexBody& second, const glm::dvec3& axis) {
  double low_m = std::numeric_limits<double>::infinity();
  double high_m = -low_m;
  for (const auto& triangle : first.triangles_m)
    for (const glm::dvec3& p : triangle)
      low_m = std::min(low_m, glm::dot(axis, p));
  for (const auto& triangle : second.triangles_m)
    for (const glm::dvec3& p : triangle)
      high_m = std::max(high_m, glm::dot(axis, p));
  return low_m - high_m;
}

/// The largest gap along the normals of all triangles and across all pairs of sides of triangles, without
/// leaving out any.
double full_largest_gap_m(const ConvexBody& first, const ConvexBody& second) {
  double largest_m = -std::numeric_limits<double>::infinity();
  const auto try_axis = [&](const glm::dvec3& axis) {
    largest_m = std::max({largest_m, full_gap_m(first, second, axis), full_gap_m(first, second, -axis)});
  };
  for (const ConvexBody* body : {&first, &second})
    for (const auto& c : body->triangles_m)
      try_axis(glm::normalize(glm::cross(c[1] - c[0], c[2] - c[0])));
  for (const auto& a : first.triangles_m) {
    for (const auto& b : second.triangles_m) {
      for (std::size_t i = 0; i < 9; ++i) {
        const glm::dvec3 across = glm::cross(a[(i + 1) % 3] - a[i % 3], b[(i / 3 + 1) % 3] - b[i / 3]);
        if (glm::length(across) > 1e-9) try_axis(glm::normalize(across));
      }
    }
  }
  return largest_m;
}

/// Calls visit(pair, truth) for pairs of two hulls, each time another two.
template <class Visit>
void each_pair(std::uint64_t seed, int count, double spread_m, Visit&& visit) {
  const Scene scene = hull_crowd(seed, 2 * count, spread_m);
  const World world = scene.world();
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    SCOPED_TRACE(i);
    const EntityId first = scene.entities[2 * i].id;
    const EntityId second = scene.entities[2 * i + 1].id;
    const PosedPair pair = posed_pair(world, first, second, at_s(10.5));
    visit(pair, pair_truth(pair));
  }
}

TEST(ContactRandom, AgreesWithLoopsOverAllTriangles) {
  int penetrating = 0;
  each_pair(910, 100, 0.4, [&](const PosedPair& pair, const PairTruth& truth) {
    const double full_m = full_largest_gap_m(pair.first_body, pair.second_body);
    ASSERT_EQ(truth.distance_m > 0.0, full_m > 0.0);
    if (truth.distance_m > 0.0) return;
    ++penetrating;
    ASSERT_NEAR(truth.distance_m, full_m, 1e-7);
    ASSERT_NEAR(full_gap_m(pair.first_body, pair.second_body, truth.n_world), full_m, 1e-7);
  });
  EXPECT_GT(penetrating, 30);
}

/// Two convex bodies are at least as far apart as the gap along any axis, and at most as far as any two of
/// their points.
TEST(ContactRandom, DistanceIsTheGapAlongTheNormalAndTheLengthOfTheSegment) {
  int apart = 0;
  each_pair(911, 500, 3.0, [&](const PosedPair& pair, const PairTruth& truth) {
    if (truth.distance_m <= 0.0) return;
    ++apart;
    ASSERT_NEAR(full_gap_m(pair.first_body, pair.second_body, truth.n_world), truth.distance_m, 1e-5);
    ASSERT_NEAR(glm::distance(truth.p_first_m, truth.p_second_m), truth.distance_m, 1e-12);
    ASSERT_LT(surface_distance_m(pair.first_body, truth.p_first_m), 1e-9);
    ASSERT_LT(surface_distance_m(pair.second_body, truth.p_second_m), 1e-9);
  });
  EXPECT_GT(apart, 200);
}

/// No other direction has a shorter way out, and the one of the truth leads out.
TEST(ContactRandom, DepthIsTheShortestTranslationThatSeparates) {
  Random random(912);
  int penetrating = 0;
  const Scene scene = hull_crowd(913, 300, 0.8);
  const World world = scene.world();
  for (std::uint32_t i = 0; i + 1 < 300; i += 2) {
    const EntityId first{i, 1};
    const EntityId second{i + 1, 1};
    const PosedPair pair = posed_pair(world, first, second, at_s(10.0));
    const PairTruth truth = pair_truth(pair);
    if (truth.distance_m >= -0.01) continue;
    ++penetrating;
    for (int k = 0; k < 300; ++k) {
      // Half of the axes are near the normal.
      const glm::dvec3 axis =
          k % 2 == 0 ? random.direction()
                     : glm::normalize(truth.n_world + random.magnitude(1e-3, 0.5) * random.vector());
      ASSERT_LE(full_gap_m(pair.first_body, pair.second_body, axis), truth.distance_m + 1e-7);
    }
    const auto moved_by = [&](double share) {
      std::vector<EntityState> two{scene.entities[i], scene.entities[i + 1]};
      two[0].row.motion.p_world_m -= share * truth.distance_m * truth.n_world;
      const World moved = world.with_entities(std::move(two), world.version_time());
      return pair_truth(moved, first, second, at_s(10.0)).distance_m;
    };
    ASSERT_NEAR(moved_by(1.0), 0.0, 1e-6);
    ASSERT_NEAR(moved_by(0.9), 0.1 * truth.distance_m, 1e-6);
    ASSERT_NEAR(moved_by(1.1), -0.1 * truth.distance_m, 1e-5);
  }
  EXPECT_GT(penetrating, 50);
}

TEST(ContactRandom, SwappedBodiesHaveTheOppositeNormal) {
  int apart = 0;
  const Scene scene = hull_crowd(914, 200, 1.5);
  const World world = scene.world();
  for (std::uint32_t i = 0; i < 200; i += 2) {
    const PairTruth one = pair_truth(world, {i, 1}, {i + 1, 1}, at_s(10.25));
    const PairTruth other = pair_truth(world, {i + 1, 1}, {i, 1}, at_s(10.25));
    ASSERT_NEAR(one.distance_m, other.distance_m, 1e-9);
    if (one.distance_m < 0.1) continue;
    ++apart;
    expect_near(one.n_world, -other.n_world, 1e-7);
  }
  EXPECT_GT(apart, 30);
}

TEST(ContactRandom, HullsOfAHundredCorners) {
  for (const double apart_m : {1.6, 1.9, 2.3}) {
    const PairTruth truth =
        truth_of(two_bodies(test::make_random_hull(915, 100, glm::dvec3(1.0)),
                            test::make_random_hull(916, 100, glm::dvec3(1.0)), {0.0, apart_m, 0.0}));
    // Faces lie below the sphere by less than a tenth of its radius.
    EXPECT_GT(truth.distance_m, apart_m - 2.0 - 1e-6);
    EXPECT_LT(truth.distance_m, apart_m - 2.0 + 0.2);
  }
}

// ---- convex meshes

TEST(ConvexMesh, IsClosedWithItsSurfaceOnTheHull) {
  const auto expect = [](const TriangleMesh& mesh, bool convex, const char* name) {
    EXPECT_EQ(is_convex(mesh), convex) << name;
    EXPECT_EQ(MeshTree(mesh).convex(), convex) << name;
  };
  expect(make_box({1, 2, 3}), true, "box");
  expect(make_sphere(2.0, 3), true, "sphere");
  expect(make_cylinder(0.5, 3.0, 17), true, "cylinder");
  expect(test::make_two_sided_rectangle(3, 4), true, "flat");
  expect(make_rectangle(3, 4), false, "one side");
  TriangleMesh open = make_box({1, 2, 3});
  open.triangles.pop_back();
  expect(open, false, "open");
  TriangleMesh turned = make_box({1, 2, 3});
  for (glm::uvec3& triangle : turned.triangles)
    std::swap(triangle.x, triangle.y);
  expect(turned, true, "inside out");
  EXPECT_TRUE(MeshTree(turned).inside_out());
  std::swap(turned.triangles[5].x, turned.triangles[5].y);
  expect(turned, false, "one triangle turned");
  TriangleMesh two = make_box({1, 1, 1});
  const TriangleMesh beside = make_box({1, 1, 1});
  for (const glm::uvec3& triangle : beside.triangles)
    two.triangles.push_back(triangle + 8u);
  for (const glm::vec3& p : beside.positions_m)
    two.positions_m.push_back(p + glm::vec3(3, 0, 0));
  expect(two, false, "two boxes");
  TriangleMesh unused = make_box({1, 1, 1});
  unused.positions_m.emplace_back(9, 9, 9);
  expect(unused, true, "a position that no triangle uses");
}

TEST(ConvexMesh, HasATolerance) {
  // A corner in the middle of a face of a box with a diagonal of 3.
  const auto dented = [](float by_m) {
    TriangleMesh mesh = make_box({2, 2, 1});
    const auto center = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.emplace_back(0.0f, 0.0f, 0.5f - by_m);
    std::vector<glm::uvec3> triangles;
    for (const glm::uvec3& t : mesh.triangles) {
      const auto& p = mesh.positions_m;
      if (p[t.x].z < 0.0f || p[t.y].z < 0.0f || p[t.z].z < 0.0f) {
        triangles.push_back(t);
        continue;
      }
      for (int i = 0; i < 3; ++i) {
        const glm::vec3 a = p[t[i]];
        const glm::vec3 b = p[t[(i + 1) % 3]];
        if (a.x == b.x || a.y == b.y) triangles.emplace_back(t[i], t[(i + 1) % 3], center);
      }
    }
    mesh.triangles = std::move(triangles);
    return mesh;
  };
  EXPECT_EQ(dented(0.0f).triangles.size(), 14u);
  EXPECT_TRUE(is_convex(dented(0.0f)));
  EXPECT_TRUE(is_convex(dented(-0.1f))) << "a pyramid";
  EXPECT_TRUE(is_convex(dented(1e-5f)));
  EXPECT_FALSE(is_convex(dented(1e-4f)));
}

/// A corner on an edge, and beside it a triangle between the edge and the corner, whose plane is rounding.
TEST(ConvexMesh, MayHaveSlivers) {
  const auto with_sliver = [](float inward_m) {
    TriangleMesh mesh = make_box({2, 2, 2});
    const auto middle = static_cast<std::uint32_t>(mesh.positions_m.size());
    mesh.positions_m.emplace_back(1.0f - inward_m, 1.0f - inward_m, 0.0f);
    const auto on_edge = [&](std::uint32_t corner) {
      return mesh.positions_m[corner].x == 1.0f && mesh.positions_m[corner].y == 1.0f;
    };
    for (std::size_t i = 0; i < 12; ++i) {
      const glm::uvec3 t = mesh.triangles[i];
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k];
        const std::uint32_t b = t[(k + 1) % 3];
        const std::uint32_t c = t[(k + 2) % 3];
        if (!on_edge(a) || !on_edge(b)) continue;
        mesh.triangles[i] = {a, middle, c};
        mesh.triangles.emplace_back(middle, b, c);
        mesh.triangles.emplace_back(a, b, middle);
        return mesh;
      }
    }
    return mesh;
  };
  EXPECT_EQ(with_sliver(0.0f).triangles.size(), 14u);
  EXPECT_TRUE(is_convex(with_sliver(0.0f))) << "without area";
  EXPECT_TRUE(is_convex(with_sliver(0x1p-22f)));
  EXPECT_TRUE(MeshTree(with_sliver(0x1p-22f)).convex());
  EXPECT_FALSE(is_convex(with_sliver(0.1f)));
  EXPECT_FALSE(MeshTree(with_sliver(0.1f)).convex());
  const PairTruth truth = truth_of(two_bodies(with_sliver(0x1p-22f), make_box({2, 2, 2}), {1.5, 0.3, 0.2}));
  EXPECT_NEAR(truth.distance_m, -0.5, 1e-6);
  EXPECT_NEAR(truth.precision_m, contact_precision * std::sqrt(12.0), 1e-5);
}

// ---- candidates

TEST(ContactCandidates, OfANamedEntityAreThoseOfAnOverlap) {
  Scene scene = hull_crowd(918, 80, 3.0);
  scene.place(GeometryId{});
  const World world = scene.world();
  ContactSearch search = search_of({7, 1});
  search.t = at_s(10.3);
  search.second_mask = 3;
  search.first_mask = 0;
  Overlap overlap;
  overlap.entity = search.first;
  overlap.mask = search.second_mask;
  overlap.t = search.t;
  std::size_t expected = 0;
  const auto candidates = contact_candidates(world, search);
  for (const EntityGap& gap : gaps(world, overlap)) {
    const auto place = std::ranges::find(candidates, gap.entity, &ContactCandidate::second);
    if (place == candidates.end()) {
      EXPECT_GT(gap.gap_m, gap.noise_m);
      continue;
    }
    ++expected;
    EXPECT_EQ(place->first, search.first);
    EXPECT_NEAR(place->gap_m, gap.gap_m, 1e-12);
    EXPECT_NEAR(place->noise_m, gap.noise_m, 1e-12);
  }
  EXPECT_EQ(candidates.size(), expected);
  EXPECT_GT(expected, 5u);
  EXPECT_TRUE(std::ranges::is_sorted(candidates, {}, [](const auto& one) { return one.second.index; }));
}

TEST(ContactCandidates, OverlapWithTheMarginOnEachSideOfTheFirst) {
  const auto gap_m = [](const glm::dvec3& p, float margin_m) {
    const Scene scene = two_bodies(make_box({2, 2, 2}), make_box({2, 2, 2}), p,
                                   glm::angleAxis(0.25 * pi, glm::dvec3(0, 0, 1)));
    return contact_candidates(scene.world(), search_of(first_id, second_id, margin_m))[0].gap_m;
  };
  const double root = std::sqrt(2.0);
  EXPECT_NEAR(gap_m({4, 0, 0}, 0.0f), 3.0 - root, 1e-12);
  EXPECT_NEAR(gap_m({4, 0, 0}, 0.25f), 2.75 - root, 1e-12);
  // Along the axis of the second one, the margin at a corner of the first one is longer.
  EXPECT_NEAR(gap_m({4, 4, 0}, 0.0f), 3.0 * root - 1.0, 1e-12);
  EXPECT_NEAR(gap_m({4, 4, 0}, 0.25f), 2.75 * root - 1.0, 1e-12);
}

TEST(ContactCandidates, OfTwoMasksAreAllTheirPairsInOrder) {
  Scene scene = hull_crowd(919, 50, 3.0);
  const World world = scene.world();
  ContactSearch search;
  search.t = at_s(10.3);
  search.first_mask = 1;
  search.second_mask = 6;
  const auto candidates = contact_candidates(world, search);
  std::vector<std::pair<std::uint32_t, std::uint32_t>> expected;
  for (const EntityState& first : scene.entities) {
    ContactSearch of_first = search;
    of_first.first = first.id;
    of_first.second_mask = (first.row.mask & 1) != 0 ? 6 : 1;
    for (const ContactCandidate& one : contact_candidates(world, of_first))
      if (one.second.index > one.first.index) expected.emplace_back(one.first.index, one.second.index);
  }
  ASSERT_EQ(candidates.size(), expected.size());
  for (std::size_t i = 0; i < expected.size(); ++i)
    EXPECT_EQ(std::pair(candidates[i].first.index, candidates[i].second.index), expected[i]);
  EXPECT_GT(expected.size(), 50u);
}

TEST(ContactCandidates, OfANamedPairAreThatPair) {
  Scene scene = two_bodies(make_box({1, 1, 1}), make_box({1, 1, 1}), {1e4, 0, 0});
  scene.entities[0].row.mask = 0;
  const auto candidates = contact_candidates(scene.world(), search_of(second_id, first_id));
  ASSERT_EQ(candidates.size(), 1u);
  EXPECT_EQ(candidates[0].first, second_id);
  EXPECT_EQ(candidates[0].second, first_id);
  EXPECT_NEAR(candidates[0].gap_m, 9999.0, 1e-9);
}

}  // namespace
}  // namespace rtstdb::oracle
