// Coherent rays, as those of a camera's image, are traced as packets (shaders/query/simd8/packet.glsl):
// whatever the image, the world's place and the bodies before it, the answers have the bits of those of
// single rays.

#include "rtstdb/query/ray/ray_coherence.hpp"
#include "tests/gpu/database_test.hpp"
#include "tests/gpu/random_scene.hpp"

namespace rtstdb::test {
namespace {

class RayPackets : public DatabaseTest {
 protected:
  /// One finely meshed body that fills the image, turned and stretched, and small ones before, within and
  /// behind it.
  void make(std::uint64_t seed, double far_m, const gpu::DeviceOptions& device) {
    open({}, device);
    Random random(seed);
    eye_m_ = far_m * random.direction();
    EntityRow body = row_of(add(make_sphere(1.0, 5)), eye_m_ + 6.0 * random.direction());
    body.scale = {random.uniform(0.5, 4.0), random.uniform(0.5, 4.0), random.uniform(0.5, 4.0)};
    body.motion.q_world = random.orientation();
    std::vector<EntityRow> rows{body};
    const GeometryId box = add(make_box({0.3, 0.2, 0.1}));
    for (std::size_t i = 0; i < seed % 4; ++i) {
      rows.push_back(row_of(box, body.motion.p_world_m + 3.0 * random.direction()));
      rows.back().motion.q_world = random.orientation();
      rows.back().mask = 2;
    }
    create(rows);
    looks_at_m_ = body.motion.p_world_m;
  }

  /// Rows of `width`; some rays see a part of the world or of the way alone.
  std::vector<Ray> image(std::uint64_t seed, std::uint32_t width, std::uint32_t count) const {
    Random random(seed + 1000);
    const glm::dvec3 ahead = glm::normalize(looks_at_m_ - eye_m_);
    const glm::dvec3 right = glm::normalize(glm::cross(ahead, random.direction()));
    const glm::dvec3 up = glm::cross(right, ahead);
    const double step = random.magnitude(1e-4, 4e-3);
    const std::uint32_t rows = count / width;
    std::vector<Ray> rays;
    for (std::uint32_t i = 0; i < count; ++i) {
      const double x = step * (i % width - 0.5 * width);
      const std::uint32_t row = i / width;
      const double y = 0.02 * (row - 0.5 * rows);
      rays.push_back(ray_from(eye_m_, ahead + x * right + y * up));
      if (random.one_in(50)) rays.back().mask = 1;
      if (random.one_in(50))
        rays.back().lambda_max = static_cast<float>(random.uniform(2.0, 10.0));
      else if (random.one_in(50))
        rays.back().lambda_min = static_cast<float>(random.uniform(2.0, 10.0));
    }
    return rays;
  }

  std::vector<std::vector<RayHit>> trace_all(std::span<const Ray> rays) {
    std::vector<std::vector<RayHit>> hits;
    for (const std::uint32_t capacity : {100u, 4096u}) {
      for (const RayMode mode : {RayMode::closest, RayMode::any})
        hits.push_back(trace(*prepare_rays(mode, false, capacity), rays));
    }
    return hits;
  }

  /// One after the other from one place, a hundredth of a radian apart at most, in groups that each look
  /// elsewhere.
  static std::vector<Ray> neighbours(Random& random, const SceneOptions& scene,
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
        const bool astray = rows.empty() || random.one_in(4);
        const glm::dvec3 at_m =
            astray ? random.direction() : rows[random.below(rows.size())].motion.p_world_m;
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

 private:
  glm::dvec3 eye_m_;
  glm::dvec3 looks_at_m_;
};

TEST_F(RayPackets, AnswerAsLoneRays) {
  std::size_t hit = 0;
  std::size_t missed = 0;
  for (std::uint64_t seed = 0; seed < 6; ++seed) {
    const double far_m = seed % 3 == 0 ? 0.0 : seed % 3 == 1 ? 300.0 : 20'000.0;
    make(seed, far_m, {});
    const auto rays = image(seed, seed % 2 == 0 ? 320 : 509, 4000);
    ASSERT_TRUE(query::are_coherent(rays)) << "seed " << seed;
    const auto together = trace_all(rays);
    make(seed, far_m, {.use_subgroup_kernels = false});
    const auto alone = trace_all(rays);
    for (std::size_t kind = 0; kind < together.size(); ++kind) {
      for (std::size_t i = 0; i < rays.size(); ++i)
        ASSERT_TRUE(same_bits(together[kind][i], alone[kind][i]))
            << "seed " << seed << ", kind " << kind << ", ray " << i;
    }
    hit += static_cast<std::size_t>(std::ranges::count(together[0], HitStatus::hit, &RayHit::status));
    missed += static_cast<std::size_t>(std::ranges::count(together[0], HitStatus::miss, &RayHit::status));
  }
  EXPECT_GT(hit, 2'500u);
  EXPECT_GT(missed, 2'500u);
}

/// Many bodies of all kinds and sizes, turned and stretched, some of them around the eye; rays of any length,
/// range and mask, some along an axis; batches of any size, and at one instant, whether their bodies move or
/// not.
TEST_F(RayPackets, AreThoseOfLoneRaysInAnyScene) {
  std::size_t hit = 0;
  std::size_t together = 0;
  for (std::uint64_t seed = 0; seed < 8; ++seed) {
    Random random(seed);
    const SceneOptions scene{
        .radius_m = random.magnitude(0.1, 1e3), .version_time = at_s(70.0), .still = seed % 2 == 0};
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
      if (rays.empty()) rays = neighbours(random, scene, rows);
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
    together += query::are_coherent(rays) ? rays.size() : 0;
  }
  EXPECT_GT(together, 3'000u);
  EXPECT_GT(hit, 1'000u);
}

/// The mesh lies far from its own origin, where a box is as wide as what its corners are rounded by.
TEST_F(RayPackets, HoldAHitAtTheEndOfARange) {
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
