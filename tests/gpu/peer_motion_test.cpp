// Queries in moving worlds, compared with Embree and nanoflann. These have no motion: for each of several
// instants of a window they get the world at that instant as a fixed mesh.

#include <algorithm>
#include <cmath>
#include <limits>
#include <ostream>
#include <string>

#include "bench/spatial/embree_nearest.hpp"
#include "bench/spatial/embree_scene.hpp"
#include "bench/spatial/nanoflann_tree.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"
#include "tests/gpu/static_scene.hpp"

namespace rtstdb::test {
namespace {

using hil::bench::EmbreeNearest;
using hil::bench::EmbreeScene;
using hil::bench::NanoflannTree;
using hil::bench::PeerHit;
using hil::bench::PeerNearest;

struct Case {
  const char* name;
  std::uint64_t seed;
  std::uint32_t entities;
  double radius_m;
  double window_s;
};

std::ostream& operator<<(std::ostream& out, const Case& test_case) {
  return out << test_case.name;
}

/// Windows begin 0.7 s after the version; longer ones than 0.3 s have two epochs (rtstdb/accel/tlas.hpp).
constexpr Case cases[] = {
    {"one_body_a_second", 81, 1, 0.3, 1.0},
    {"forty_within_a_millisecond", 82, 40, 4.0, 1e-3},
    {"forty_within_a_second", 83, 40, 4.0, 1.0},
    {"four_hundred_within_a_twentieth", 84, 400, 14.0, 0.05},
    {"four_hundred_within_half_a_second", 85, 400, 14.0, 0.5},
    {"large_build_within_a_second", 86, 2500, 33.0, 1.0},
};

/// Both sides compute in single precision: units in the last place of the magnitudes involved.
constexpr double rounding = 32.0 * 0x1p-24;
constexpr double lambda_tolerance = 1e-4;

class PeersInMotion : public DatabaseTest, public testing::WithParamInterface<Case> {
 protected:
  static constexpr std::size_t instants = 5;
  static constexpr std::size_t per_instant = 4000;
  SceneOptions options_{.radius_m = GetParam().radius_m, .version_time = at_s(3600.0)};
  Random random_{GetParam().seed};
  std::vector<TriangleMesh> meshes_;
  std::vector<EntityState> entities_;
  std::vector<StaticScene> static_scenes_;  // by instant
  std::vector<WorldTime> times_;

  void SetUp() override {
    DatabaseTest::SetUp();
    meshes_ = mixed_meshes(random_);
    std::vector<GeometryId> geometries;
    // bench/spatial/embree_nearest.cpp does not support triangles without area.
    for (TriangleMesh& mesh : meshes_)
      std::erase_if(mesh.triangles, [](const glm::uvec3& one) { return one.x == one.z; });
    for (const TriangleMesh& mesh : meshes_)
      geometries.push_back(add(mesh));
    std::vector<EntityRow> rows;
    for (std::uint32_t i = 0; i < GetParam().entities; ++i)
      rows.push_back(random_row(random_, geometries, options_, rows));
    if (rows.size() == 1) {
      rows[0].geometry = geometries[2];
      rows[0].motion.v_world_mps = {1.0, -3.0, 2.0};
      rows[0].motion.w_world_radps = {9.0, 5.0, -20.0};
      rows[0].motion.p_world_m -=
          rows[0].motion.v_world_mps * seconds_between(rows[0].motion.valid_from, options_.version_time);
    }
    create(rows, options_.version_time);
    entities_ = database().snapshot({}).value();
    const WorldTime first = options_.version_time + Nanoseconds(700'000'000);
    for (std::size_t k = 0; k < instants; ++k) {
      const double share = k == 0 ? 0.0 : k == 1 ? 1.0 : random_.uniform(0.0, 1.0);
      times_.push_back(first + Nanoseconds(static_cast<std::int64_t>(share * GetParam().window_s * 1e9)));
      static_scenes_.push_back(static_scene(entities_, meshes_, times_.back()));
    }
  }

  /// per_instant rays for each instant.
  std::vector<Ray> rays() {
    std::vector<Ray> made;
    for (const WorldTime t : times_) {
      for (std::size_t i = 0; i < per_instant; ++i) {
        made.push_back(random_ray(random_, entities_, options_, t, 0.0));
        made.back().mask = mask_all;
      }
    }
    return made;
  }

  /// A hit of either side: the triangle of the static scene, and lambda.
  struct Claim {
    std::uint32_t triangle = 0;
    double lambda = -1.0;
    bool hit() const { return lambda >= 0.0; }
  };
  Claim claim_of(const RayHit& hit, const StaticScene& world) const {
    EXPECT_NE(hit.status, HitStatus::incomplete);
    if (hit.status != HitStatus::hit) return {};
    return {world.first[hit.entity.index] + hit.triangle, static_cast<double>(hit.lambda)};
  }
  static Claim claim_of(const PeerHit& hit) { return {hit.triangle, static_cast<double>(hit.lambda)}; }

  static double error_m(const Ray& ray, const Claim& claim) {
    const double distance_m = std::max(claim.lambda, 0.0) * glm::length(glm::dvec3(ray.direction));
    return rounding * (2.0 * glm::length(glm::dvec3(ray.origin_m)) + distance_m + 2.0);
  }
  /// Whether the ray, shifted by at most the rounding error, hits the claimed triangle there.
  static bool is_possible(const StaticScene& world, const Ray& ray, const Claim& claim) {
    const double error = error_m(ray, claim);
    const Intersection hit = intersect(world, claim.triangle, ray, error);
    const double along = error / glm::length(glm::dvec3(ray.direction)) + lambda_tolerance * claim.lambda;
    return hit.ever && claim.lambda >= hit.min_lambda - along && claim.lambda <= hit.max_lambda + along;
  }
  /// Whether rounding may hide the claimed hit from the side that has the hit `other`.
  static bool may_be_missed(const StaticScene& world, const Ray& ray, const Claim& claim,
                            const Claim& other) {
    const double error = error_m(ray, claim);
    const Intersection hit = intersect(world, claim.triangle, ray, error);
    if (!hit.always) return true;  // at an edge
    const double doubt = hit.max_lambda - hit.min_lambda + error / glm::length(glm::dvec3(ray.direction));
    const auto near = [&](double lambda, double tolerance) {
      return std::abs(claim.lambda - lambda) <= tolerance;
    };
    return near(static_cast<double>(ray.lambda_min), doubt) ||
           near(static_cast<double>(ray.lambda_max), doubt) ||
           (other.hit() && near(other.lambda, doubt + lambda_tolerance * claim.lambda));
  }

  /// Counts differences, each of which rounding has to explain.
  Tally compare(const StaticScene& world, std::span<const Ray> rays, std::span<const RayHit> ours,
                std::span<const PeerHit> theirs) const {
    Tally tally;
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Ray ray = in_world(rays[i], entities_);
      const Claim our_claim = claim_of(ours[i], world), their_claim = claim_of(theirs[i]);
      ++tally.elements;
      tally.hits += their_claim.hit() ? 1 : 0;
      const bool same_lambda =
          std::abs(our_claim.lambda - their_claim.lambda) <= lambda_tolerance * their_claim.lambda;
      if (!our_claim.hit() && !their_claim.hit()) continue;
      if (our_claim.triangle == their_claim.triangle && same_lambda) continue;
      ++tally.too_close;
      const bool ours_is_nearer =
          our_claim.hit() && (!their_claim.hit() || our_claim.lambda < their_claim.lambda);
      const bool explained = ours_is_nearer ? may_be_missed(world, ray, our_claim, their_claim)
                                            : may_be_missed(world, ray, their_claim, our_claim);
      EXPECT_TRUE(explained && (!our_claim.hit() || is_possible(world, ray, our_claim)))
          << "ray " << i << ": triangle " << our_claim.triangle << " at " << our_claim.lambda
          << ", Embree has triangle " << their_claim.triangle << " at " << their_claim.lambda;
    }
    return tally;
  }
};

TEST_P(PeersInMotion, ClosestHitsAgreeWithEmbree) {
  const auto all_rays = rays();
  const auto hits =
      trace(*prepare_rays(RayMode::closest, false, static_cast<std::uint32_t>(all_rays.size())), all_rays);
  Tally tally;
  for (std::size_t k = 0; k < instants; ++k) {
    const auto part = std::span(all_rays).subspan(k * per_instant, per_instant);
    std::vector<Ray> their_rays;
    for (const Ray& ray : part)
      their_rays.push_back(in_world(ray, entities_));
    std::vector<PeerHit> theirs(per_instant);
    EmbreeScene(static_scenes_[k].mesh).closest(their_rays, theirs);
    tally += compare(static_scenes_[k], part, std::span(hits).subspan(k * per_instant, per_instant), theirs);
  }
  EXPECT_GT(tally.hits, tally.elements / 5);
  EXPECT_LT(tally.hits, tally.elements * 4 / 5);
  EXPECT_LT(tally.too_close, tally.elements / 500);
  RecordProperty("hits", std::to_string(tally.hits));
  RecordProperty("different_by_rounding", std::to_string(tally.too_close));
}

TEST_P(PeersInMotion, AnyHitsAgreeWithEmbree) {
  const auto all_rays = rays();
  const auto hits =
      trace(*prepare_rays(RayMode::any, false, static_cast<std::uint32_t>(all_rays.size())), all_rays);
  std::size_t hit_count = 0, different = 0;
  for (std::size_t k = 0; k < instants; ++k) {
    std::vector<Ray> their_rays;
    for (std::size_t i = 0; i < per_instant; ++i)
      their_rays.push_back(in_world(all_rays[k * per_instant + i], entities_));
    std::vector<PeerHit> theirs(per_instant);
    EmbreeScene(static_scenes_[k].mesh).any(their_rays, theirs);
    for (std::size_t i = 0; i < per_instant; ++i) {
      const bool ours_hits = hits[k * per_instant + i].status == HitStatus::hit;
      hit_count += theirs[i].lambda >= 0.0f ? 1 : 0;
      different += ours_hits != (theirs[i].lambda >= 0.0f) ? 1 : 0;
    }
  }
  EXPECT_GT(hit_count, all_rays.size() / 5);
  EXPECT_LT(hit_count, all_rays.size() * 4 / 5);
  // The mode any does not name triangles; ClosestHitsAgreeWithEmbree explains each difference of its rays.
  EXPECT_LE(different, all_rays.size() / 1000);
}

/// The k nearest of all entities at any distance. Ties may be broken either way: the distances have to agree.
class NearestOfPeersInMotion : public PeersInMotion {
 protected:
  static constexpr std::size_t points_per_instant = 1000;

  std::vector<Nearest> points() {
    std::vector<Nearest> made;
    for (const WorldTime t : times_) {
      for (std::size_t i = 0; i < points_per_instant; ++i) {
        made.push_back(random_point(random_, entities_, options_, t, 0.0));
        made.back().radius_m = std::numeric_limits<float>::infinity();
        made.back().mask = mask_all;
        made.back().excluded = {};
      }
    }
    return made;
  }
  std::unique_ptr<NearestQuery> run_nearest(std::span<const Nearest> points, NearestTarget target,
                                            std::uint32_t k) {
    const auto count = static_cast<std::uint32_t>(points.size());
    auto query = database().prepare(
        NearestQueryOptions{.name = "nearest", .capacity = count, .target = target, .k = k});
    EXPECT_TRUE(query.ok());
    std::ranges::copy(points, query.value()->points().begin());
    const Outcome outcome =
        execute([&](Transaction& transaction) { transaction.add_query(*query.value(), count); });
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    return std::move(query).value();
  }
  std::vector<glm::vec3> in_world_m(std::span<const Nearest> points) const {
    std::vector<glm::vec3> made;
    for (const Nearest& point : points) {
      const auto carrier = std::ranges::find(entities_, point.carrier, &EntityState::id);
      made.push_back(carrier == entities_.end()
                         ? point.point_m
                         : glm::vec3(world_point(carrier->row.motion, point.t, point.point_m)));
    }
    return made;
  }
  static double error_m(const glm::vec3& point_m, double distance_m) {
    return rounding * (2.0 * glm::length(glm::dvec3(point_m)) + distance_m + 2.0);
  }
};

TEST_P(NearestOfPeersInMotion, DistancesOfTrianglesAgreeWithEmbree) {
  const auto all_points = points();
  const auto query = run_nearest(all_points, NearestTarget::triangle, 1);
  std::size_t other_triangle = 0;
  for (std::size_t k = 0; k < instants; ++k) {
    const auto points_m =
        in_world_m(std::span(all_points).subspan(k * points_per_instant, points_per_instant));
    std::vector<PeerNearest> theirs(points_per_instant);
    EmbreeNearest(static_scenes_[k].mesh).nearest(points_m, theirs);
    for (std::size_t i = 0; i < points_per_instant; ++i) {
      const NearestAnswer& answer = query->answers()[k * points_per_instant + i];
      ASSERT_EQ(answer.neighbors.size(), 1u);
      const Neighbor& ours = answer.neighbors[0];
      ASSERT_NEAR(ours.distance_m, theirs[i].distance_m,
                  error_m(points_m[i], static_cast<double>(theirs[i].distance_m)))
          << "point " << i << " of instant " << k;
      const EntityTriangle source = static_scenes_[k].source[theirs[i].triangle];
      other_triangle += source == EntityTriangle{ours.entity, ours.triangle} ? 0 : 1;
    }
  }
  // On edges and corners the nearest point is on several triangles.
  EXPECT_LT(other_triangle, all_points.size() / 2);
  RecordProperty("another_triangle_as_near", std::to_string(other_triangle));
}

TEST_P(NearestOfPeersInMotion, CentersAgreeWithNanoflann) {
  const std::uint32_t k_nearest = std::min(8u, GetParam().entities);
  const auto all_points = points();
  const auto query = run_nearest(all_points, NearestTarget::center, k_nearest);
  for (std::size_t k = 0; k < instants; ++k) {
    std::vector<glm::vec3> centers_m;
    for (const EntityState& entity : entities_) {
      const Bounds bounds = bounds_of(meshes_[entity.row.geometry.index]);
      const glm::dvec3 center_m = 0.5 * (glm::dvec3(bounds.minimum_m) + glm::dvec3(bounds.maximum_m));
      centers_m.emplace_back(world_point(entity.row.motion, times_[k], entity.row.scale * center_m));
    }
    const NanoflannTree tree(centers_m);
    const auto points_m =
        in_world_m(std::span(all_points).subspan(k * points_per_instant, points_per_instant));
    std::vector<std::uint32_t> numbers(k_nearest * points_m.size());
    std::vector<float> squared_m2(k_nearest * points_m.size());
    tree.nearest(points_m, k_nearest, numbers, squared_m2);
    for (std::size_t i = 0; i < points_per_instant; ++i) {
      const auto neighbors = query->answers()[k * points_per_instant + i].neighbors;
      ASSERT_EQ(neighbors.size(), k_nearest);
      for (std::size_t j = 0; j < k_nearest; ++j) {
        const auto distance_m = std::sqrt(static_cast<double>(squared_m2[i * k_nearest + j]));
        const double error = error_m(points_m[i], distance_m);
        ASSERT_NEAR(neighbors[j].distance_m, distance_m, error) << "point " << i << ", instant " << k;
        // The named entity has that distance.
        const auto entity = std::ranges::find(entities_, neighbors[j].entity, &EntityState::id);
        ASSERT_NE(entity, entities_.end());
        const glm::vec3& center_m = centers_m[static_cast<std::size_t>(entity - entities_.begin())];
        ASSERT_NEAR(glm::distance(glm::dvec3(center_m), glm::dvec3(points_m[i])), distance_m, error);
      }
    }
  }
}

const auto name_of = [](const testing::TestParamInfo<Case>& test_case) {
  return std::string(test_case.param.name);
};
INSTANTIATE_TEST_SUITE_P(Windows, PeersInMotion, testing::ValuesIn(cases), name_of);
INSTANTIATE_TEST_SUITE_P(Windows, NearestOfPeersInMotion, testing::ValuesIn(cases), name_of);

}  // namespace
}  // namespace rtstdb::test
