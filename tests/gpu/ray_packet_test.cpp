// The kernels that trace rays as packets, with work sharing and one by one (shaders/query/simd8) give the
// same bits.

#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

class RayPackets : public DatabaseTest {
 protected:
  /// Groups of rays with one origin and at most a hundredth of a radian between them.
  static std::vector<Ray> coherent_groups(Random& random, const SceneOptions& scene,
                                          std::span<const EntityRow> rows) {
    std::vector<Ray> rays(random.one_in(2) ? 1 + random.below(200) : 1 + random.below(3000));
    glm::vec3 eye_m;
    glm::dvec3 ahead;
    std::size_t left = 0;
    const WorldTime t = at_s(70.0 + (random.one_in(2) ? 0.0 : random.uniform(0.0, 1.0)));
    for (Ray& ray : rays) {
      if (left == 0) {
        left = random.one_in(4) ? 1 + random.below(20) : 8 * (1 + random.below(40));
        eye_m = scene.radius_m * random.uniform(0.0, 2.0) * random.direction();
        const bool into_nowhere = rows.empty() || random.one_in(4);
        const glm::dvec3 at_m =
            into_nowhere ? random.direction() : rows[random.below(rows.size())].motion.p_world_m;
        ahead = glm::normalize(at_m - glm::dvec3(eye_m));
        if (random.one_in(4)) ahead[static_cast<int>(random.below(3))] = 0.0;
        if (random.one_in(4)) ahead = glm::dvec3(random.below(3) == 0, random.below(2) == 0, -1.0);
      }
      --left;
      glm::dvec3 d = glm::normalize(ahead) + 0.005 * random.direction();
      if (random.one_in(5)) d = ahead;
      ray = ray_from(eye_m, glm::vec3(random.magnitude(1e-3, 1e3) * d), t);
      if (random.one_in(20)) ray.mask = static_cast<std::uint32_t>(random.engine());
      const double reach = 3.0 * scene.radius_m / glm::length(glm::dvec3(ray.direction));
      if (random.one_in(10)) ray.lambda_max = static_cast<float>(random.uniform(0.0, reach));
      if (random.one_in(10))
        ray.lambda_min = std::min(ray.lambda_max, static_cast<float>(random.uniform(0.0, reach)));
      if (random.one_in(40)) ray.lambda_max = ray.lambda_min;
    }
    return rays;
  }

  static std::size_t differences(const std::vector<RayHit>& a, const std::vector<RayHit>& b) {
    EXPECT_EQ(a.size(), b.size());
    std::size_t count = 0;
    for (std::size_t i = 0; i < a.size(); ++i)
      count += same_bits(a[i], b[i]) ? 0 : 1;
    return count;
  }
  /// By each kernel: at an instant or over the window, the closest hit or any.
  std::vector<std::vector<RayHit>> trace_by_each_kernel(std::span<const Ray> rays) {
    std::vector<std::vector<RayHit>> hits;
    for (const bool ignore_motion : {false, true}) {
      for (const RayMode mode : {RayMode::closest, RayMode::any})
        hits.push_back(trace(*prepare_rays(mode, ignore_motion), rays));
    }
    return hits;
  }
};

/// In coherent order rays form packets. In another order, or without subgroup kernels, each is traced by a
/// lane.
TEST_F(RayPackets, AnswerAsSingleRaysInAnyOrder) {
  for (const std::uint32_t entities : {1u, 200u, 2500u}) {
    std::vector<Ray> rays(4000);
    const auto make_world = [&](const gpu::DeviceOptions& device) {
      open({}, device);
      Random random(77);
      const SceneOptions scene{.radius_m = entities > 2048 ? 36.0 : 10.0, .version_time = at_s(5.0)};
      std::vector<GeometryId> geometries;
      for (const TriangleMesh& mesh : mixed_meshes(random))
        geometries.push_back(add(mesh));
      std::vector<EntityRow> rows;
      for (std::uint32_t i = 0; i < entities; ++i)
        rows.push_back(random_row(random, geometries, scene, rows));
      create(rows, scene.version_time);
      fill_with_neighbours(rays, random, database().snapshot({}).value(), scene, scene.version_time, 0.8);
    };
    make_world({});
    std::vector<Ray> shuffled;
    for (std::size_t offset = 0; offset < 8; ++offset)
      for (std::size_t i = offset; i < rays.size(); i += 8)
        shuffled.push_back(rays[i]);
    ASSERT_TRUE(query::are_coherent(rays));
    ASSERT_FALSE(query::are_coherent(shuffled));
    const auto in_packets = trace_by_each_kernel(rays);
    const auto by_lanes = trace_by_each_kernel(shuffled);
    make_world({.use_subgroup_kernels = false});
    const auto without_subgroups = trace_by_each_kernel(rays);
    for (std::size_t kernel = 0; kernel < in_packets.size(); ++kernel) {
      SCOPED_TRACE(testing::Message() << entities << " entities, kernel " << kernel);
      std::vector<RayHit> in_order(rays.size());
      for (std::size_t i = 0; i < rays.size(); ++i)
        in_order[i % 500 * 8 + i / 500] = by_lanes[kernel][i];
      EXPECT_EQ(differences(in_packets[kernel], in_order), 0u) << "by a lane each";
      EXPECT_EQ(differences(in_packets[kernel], without_subgroups[kernel]), 0u) << "without subgroup kernels";
      EXPECT_GT(std::ranges::count(in_packets[kernel], HitStatus::hit, &RayHit::status), 250);
      EXPECT_GT(std::ranges::count(in_packets[kernel], HitStatus::miss, &RayHit::status), 250);
    }
  }
}

/// Bodies of all sizes, some around the eye, up to 20 km from the world's origin; rays of any length, range
/// and mask, some along an axis; batches of any size at one instant.
TEST_F(RayPackets, AnswerAsSingleRaysInAnyScene) {
  std::size_t hit = 0;
  std::size_t coherent = 0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Random random(seed);
    const SceneOptions scene{
        .radius_m = random.magnitude(0.1, 1e4), .version_time = at_s(70.0), .still = seed % 2 == 0};
    const bool ignore_motion = random.one_in(3);
    const std::size_t bodies = random.below(40);
    std::vector<Ray> rays;
    std::vector<std::vector<RayHit>> hits;
    for (const bool use_subgroup_kernels : {true, false}) {
      Random same(seed + 1);
      open({}, {.use_subgroup_kernels = use_subgroup_kernels});
      std::vector<GeometryId> geometries;
      for (const TriangleMesh& mesh : mixed_meshes(same))
        geometries.push_back(add(mesh));
      geometries.push_back(add(make_sphere(1.0, 5)));
      std::vector<EntityRow> rows;
      for (std::size_t i = 0; i < bodies; ++i) {
        rows.push_back(random_row(same, geometries, scene, rows));
        if (same.one_in(3)) rows.back().scale *= static_cast<float>(same.magnitude(1e-2, 1e2));
      }
      create(rows, scene.version_time);
      if (rays.empty()) rays = coherent_groups(random, scene, rows);
      for (const RayMode mode : {RayMode::closest, RayMode::any})
        hits.push_back(
            trace(*prepare_rays(mode, ignore_motion, static_cast<std::uint32_t>(rays.size())), rays));
    }
    for (const std::size_t mode : {0u, 1u}) {
      for (std::size_t i = 0; i < rays.size(); ++i)
        ASSERT_TRUE(same_bits(hits[mode][i], hits[2 + mode][i]))
            << "seed " << seed << ", mode " << mode << ", ray " << i << " of " << rays.size();
    }
    hit += static_cast<std::size_t>(std::ranges::count(hits[0], HitStatus::hit, &RayHit::status));
    coherent += query::are_coherent(rays) ? rays.size() : 0;
  }
  EXPECT_GT(coherent, 3'000u);
  EXPECT_GT(hit, 1'000u);
}

/// The mesh lies so far from its origin that rounding is as large as its boxes.
TEST_F(RayPackets, IncludeAHitAtTheEndOfTheRange) {
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Random random(seed);
    TriangleMesh floor = make_sphere(1.0, 4);
    for (glm::vec3& p : floor.positions_m)
      p = {1000.0f + p.x, 1000.0f + p.y, 1000.3f + 1e-4f * p.z};
    open({});
    EntityRow row = row_of(add(floor));
    if (seed != 0) row.motion.q_world = random.orientation();
    row.motion.p_world_m = row.motion.q_world * glm::dvec3(-1000.0);
    create(row);
    std::vector<Ray> rays;
    for (int i = 0; i < 4000; ++i) {
      const glm::dvec3 d(random.uniform(-0.005, 0.005), random.uniform(-0.005, 0.005), -1.0);
      rays.push_back(ray_from(glm::vec3(row.motion.q_world * glm::dvec3(0.0, 0.0, 1.5)),
                              glm::vec3(row.motion.q_world * d)));
    }
    ASSERT_TRUE(query::are_coherent(rays));
    const auto query = prepare_rays();
    const auto hits = trace(*query, rays);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(hits[i].status, HitStatus::hit) << "seed " << seed << ", ray " << i;
      rays[i].lambda_max = hits[i].lambda;
    }
    const auto until = trace(*query, rays);
    for (std::size_t i = 0; i < rays.size(); ++i)
      ASSERT_TRUE(same_bits(hits[i], until[i])) << "seed " << seed << ", ray " << i;
  }
}

}  // namespace
}  // namespace rtstdb::test
