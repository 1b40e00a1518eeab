// A hit depends on the ray and the triangle alone, also where rounding is large: close to large triangles, at
// the ends of a range, along the outline of far bodies. It must not depend on the boxes of the tree that a
// packet visits.

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

class RayBounds : public DatabaseTest {
 protected:
  /// Traces each ray in a packet with six copies and one ray that `change` makes different.
  std::vector<RayHit> trace_in_packets(std::span<const Ray> rays, const std::function<void(Ray&)>& change) {
    std::vector<Ray> all;
    for (const Ray& ray : rays) {
      all.insert(all.end(), 8, ray);
      change(all.back());
    }
    const auto query = prepare_rays();
    const auto hits = trace(*query, all);
    std::vector<RayHit> first;
    for (std::size_t i = 0; i < hits.size(); i += 8)
      first.push_back(hits[i]);
    return first;
  }
  static std::size_t differences(std::span<const RayHit> a, std::span<const RayHit> b) {
    EXPECT_EQ(a.size(), b.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      count += same_bits(a[i], b[i]) ? 0 : 1;
    return count;
  }
};

std::vector<Ray> rays_down_to_a_floor(double size_m, double height_m, Random& random) {
  std::vector<Ray> rays;
  for (int i = 0; i < 1000; ++i) {
    glm::dvec3 direction = random.direction();
    direction.z = -0.3 * std::abs(direction.z) - 0.1;
    rays.push_back(
        ray_from(glm::dvec3(random.uniform(-0.3, 0.3) * size_m, random.uniform(-0.3, 0.3) * size_m, height_m),
                 direction));
  }
  return rays;
}

TEST_F(RayBounds, IncludeAHitAtAnEndOfTheRange) {
  for (const bool use_subgroup_kernels : {true, false}) {
    for (const double size_m : {20.0, 2000.0, 20'000.0}) {
      open({}, {.use_subgroup_kernels = use_subgroup_kernels});
      create(row_of(add(make_rectangle(size_m, size_m))));
      Random random(110);
      for (const double height_m : {0.01, 1.5, 30.0}) {
        const auto query = prepare_rays();
        const auto any = prepare_rays(RayMode::any);
        const auto rays = rays_down_to_a_floor(size_m, height_m, random);
        const auto hits = trace(*query, rays);
        std::vector<Ray> until, from;
        std::vector<RayHit> expected;
        for (std::size_t i = 0; i < rays.size(); ++i) {
          if (hits[i].status != HitStatus::hit) continue;
          expected.push_back(hits[i]);
          until.push_back(rays[i]);
          until.back().lambda_max = hits[i].lambda;
          from.push_back(rays[i]);
          from.back().lambda_min = hits[i].lambda;
        }
        SCOPED_TRACE(testing::Message()
                     << size_m << " m, from " << height_m << " m, subgroup kernels " << use_subgroup_kernels);
        EXPECT_EQ(differences(trace(*query, until), expected), 0u);
        EXPECT_EQ(differences(trace(*query, from), expected), 0u);
        EXPECT_EQ(differences(trace_in_packets(until, [](Ray& ray) { ray.lambda_max = 1e30f; }), expected),
                  0u);
        EXPECT_EQ(differences(trace_in_packets(from, [](Ray& ray) { ray.lambda_min = 0.0f; }), expected), 0u);
        EXPECT_EQ(std::ranges::count(trace(*any, until), HitStatus::hit, &RayHit::status), std::ssize(until));
        EXPECT_GT(expected.size(), height_m < 1.0 ? 999u : 5u);
      }
    }
  }
}

TEST_F(RayBounds, GiveTheSameNearestOfTwoCloseTrianglesInEveryPacket) {
  for (const bool use_subgroup_kernels : {true, false}) {
    for (const double size_m : {200.0, 2000.0, 20'000.0}) {
      open({}, {.use_subgroup_kernels = use_subgroup_kernels});
      create(row_of(add(make_rectangle(size_m, size_m))));
      const GeometryId plate = add(make_rectangle(0.2, 0.2));
      Random random(1);
      std::vector<EntityRow> rows;
      for (int i = 0; i < 200; ++i)
        rows.push_back(row_of(plate, {random.uniform(-20, 20), random.uniform(-20, 20), 1e-5}));
      create(rows);
      std::vector<Ray> rays;
      for (const EntityRow& row : rows) {
        for (int k = 0; k < 10; ++k) {
          const glm::dvec3 to_m =
              row.motion.p_world_m + glm::dvec3(random.uniform(-0.09, 0.09), random.uniform(-0.09, 0.09), 0);
          const glm::dvec3 direction(random.uniform(-1, 1), random.uniform(-1, 1), -0.7);
          rays.push_back(ray_from(to_m - 2.0 * direction, direction));
        }
      }
      const auto query = prepare_rays();
      const auto hits = trace(*query, rays);
      const auto in_packets =
          trace_in_packets(rays, [](Ray& ray) { ray.direction.x += 0.02f * glm::length(ray.direction); });
      EXPECT_EQ(differences(hits, in_packets), 0u) << size_m << " m";
      const auto first = prepare_rays(RayMode::first);
      const auto listed = trace(*first, rays);
      for (std::size_t i = 0; i < rays.size(); ++i)
        ASSERT_TRUE(same_bits(hits[i], listed[i]))
            << "ray " << i << ": " << hits[i].lambda << ", " << listed[i].lambda;
    }
  }
}

/// With two entities the TLAS has boxes around them.
TEST_F(RayBounds, GiveTheSameOutlineOfAFarBodyInEveryPacket) {
  EntityRow row = row_of(add(make_box({2, 2, 2})));
  row.motion.q_world = {-0.89875604550611254, 0, 0, 0.43844905139162349};
  row.scale = glm::dvec3(1.1993545635552838);
  create(std::vector<EntityRow>(2, row));
  double top_m = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const glm::dvec3 p(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    top_m = std::max(top_m, (row.motion.q_world * (row.scale * p)).y);
  }
  Random random(24);
  std::vector<Ray> rays;
  for (int i = 0; i < 2000; ++i)
    rays.push_back(ray_from(glm::dvec3(1e4, top_m + random.uniform(-1e-3, 5e-3), -0.36), {-1, 0, 0}));
  const auto query = prepare_rays();
  const auto hits = trace(*query, rays);
  const auto in_packets =
      trace_in_packets(rays, [&](Ray& ray) { ray.origin_m.y = static_cast<float>(top_m - 0.001); });
  EXPECT_EQ(differences(hits, in_packets), 0u);
  const auto hit_count = std::ranges::count(hits, HitStatus::hit, &RayHit::status);
  EXPECT_GT(hit_count, 50);
  EXPECT_LT(hit_count, 1950);
}

}  // namespace
}  // namespace rtstdb::test
