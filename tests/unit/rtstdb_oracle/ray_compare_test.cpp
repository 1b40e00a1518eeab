// The comparison accepts a single-precision tracer, with few verdicts too_close, and rejects each tampered
// answer.

#include <glm/ext/vector_float3.hpp>
#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include "scene.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::oracle {
namespace {

/// A brute-force single-precision tracer (Moeller-Trumbore), as a device could do it: rows are rebased to the
/// version's time in double precision, and the rest is in single precision.
class FloatTracer {
 public:
  explicit FloatTracer(const Scene& scene) : scene_(scene) {
    for (EntityState& state : entities_ = scene.entities)
      state.row.motion = rebased(state.row.motion, scene.version_time);
  }

  RayHit operator()(const Ray& ray, bool ignore_motion) const {
    const float dt_s = ignore_motion ? 0.0f : static_cast<float>(seconds_between(scene_.version_time, ray.t));
    glm::vec3 origin = ray.origin_m;
    glm::vec3 direction = ray.direction;
    glm::vec3 v_origin(0.0f);
    if (ray.carrier.valid()) {
      const Motion& motion = entities_[ray.carrier.index].row.motion;
      const glm::quat q = turned(motion, dt_s);
      const glm::vec3 arm = q * origin;
      origin = moved(motion, dt_s) + arm;
      direction = q * direction;
      v_origin = glm::vec3(motion.v_world_mps) + glm::cross(glm::vec3(motion.w_world_radps), arm);
    }
    RayHit best;
    best.lambda = ray.lambda_max;
    for (const EntityState& state : entities_) {
      if ((state.row.mask & ray.mask) != 0) intersect(state, ray, origin, direction, dt_s, best);
    }
    if (best.status == HitStatus::hit) {
      const Motion& motion = entities_[best.entity.index].row.motion;
      const glm::vec3 arm = origin + best.lambda * direction - moved(motion, dt_s);
      best.v_relative_mps =
          glm::vec3(motion.v_world_mps) + glm::cross(glm::vec3(motion.w_world_radps), arm) - v_origin;
    }
    return best;
  }

 private:
  static glm::vec3 moved(const Motion& motion, float dt_s) {
    return glm::vec3(motion.p_world_m) + dt_s * glm::vec3(motion.v_world_mps);
  }
  static glm::quat turned(const Motion& motion, float dt_s) {
    const glm::vec3 turn = dt_s * glm::vec3(motion.w_world_radps);
    const float angle = glm::length(turn);
    const glm::quat q(motion.q_world);
    return angle > 1e-6f ? glm::normalize(glm::angleAxis(angle, turn / angle) * q) : q;
  }

  void intersect(const EntityState& state, const Ray& ray, const glm::vec3& origin,
                 const glm::vec3& direction, float dt_s, RayHit& best) const {
    const glm::quat q = turned(state.row.motion, dt_s);
    const glm::vec3 scale(state.row.scale);
    const glm::vec3 o = glm::conjugate(q) * (origin - moved(state.row.motion, dt_s)) / scale;
    const glm::vec3 d = glm::conjugate(q) * direction / scale;
    const TriangleMesh& mesh = scene_.meshes[state.row.geometry.index];
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const glm::vec3 a = mesh.positions_m[mesh.triangles[i].x];
      const glm::vec3 e1 = mesh.positions_m[mesh.triangles[i].y] - a;
      const glm::vec3 e2 = mesh.positions_m[mesh.triangles[i].z] - a;
      const glm::vec3 across = glm::cross(d, e2);
      const float determinant = glm::dot(e1, across);
      if (determinant == 0.0f) continue;
      const glm::vec3 s = o - a;
      const float u = glm::dot(s, across) / determinant;
      const glm::vec3 r = glm::cross(s, e1);
      const float v = glm::dot(d, r) / determinant;
      const float lambda = glm::dot(e2, r) / determinant;
      if (u < 0.0f || v < 0.0f || u + v > 1.0f || lambda < ray.lambda_min || lambda > best.lambda) continue;
      if (best.status == HitStatus::hit && lambda == best.lambda) continue;  // the earlier index stays
      best.status = HitStatus::hit;
      best.lambda = lambda;
      best.u = u;
      best.v = v;
      best.entity = state.id;
      best.triangle = i;
      best.n_world = glm::normalize(q * (glm::cross(e1, e2) / scale));
      best.front_face = glm::dot(best.n_world, direction) < 0.0f;
    }
  }

  const Scene& scene_;
  std::vector<EntityState> entities_;
};

TEST(CompareRay, AcceptsASinglePrecisionTracer) {
  std::uint64_t too_close = 0;
  std::uint64_t hits = 0;
  const std::uint64_t rounds = hil::tests::rounds(5);
  constexpr int rays = 4000;
  for (std::uint64_t round = 0; round < rounds; ++round) {
    const Scene scene = crowd(20 + round, 40);
    const World world = scene.world();
    const FloatTracer tracer(scene);
    Random random(40 + round);
    for (int i = 0; i < rays; ++i) {
      const Ray ray = random_ray(random, scene);
      const bool ignore_motion = i % 7 == 0;
      const RayHit answer = tracer(ray, ignore_motion);
      const RayTruth truth = trace(world, ray, RayMode::closest, ignore_motion);
      const Judgement judgement = compare(world, ray, RayMode::closest, ignore_motion, truth, answer);
      ASSERT_NE(judgement.verdict, Verdict::differs) << round << " " << i << ": " << judgement.reason;
      too_close += judgement.verdict == Verdict::too_close;
      hits += truth.status == HitStatus::hit;
      const Judgement any = compare(world, ray, RayMode::any, ignore_motion,
                                    trace(world, ray, RayMode::any, ignore_motion), answer);
      ASSERT_NE(any.verdict, Verdict::differs) << any.reason;
    }
  }
  EXPECT_GT(hits, rounds * rays / 10);
  EXPECT_LT(too_close, rounds * rays / 1000);
}

struct Tampering {
  const char* name;
  std::function<void(RayHit&)> with;
};

class CompareTamperedRay : public testing::TestWithParam<Tampering> {};

TEST_P(CompareTamperedRay, IsRejected) {
  const Scene scene = crowd(60, 40);
  const World world = scene.world();
  const FloatTracer tracer(scene);
  Random random(61);
  int tried = 0;
  int rejected = 0;
  for (int i = 0; i < 1500; ++i) {
    const Ray ray = random_ray(random, scene);
    RayHit answer = tracer(ray, false);
    if (answer.status != HitStatus::hit || glm::length(answer.v_relative_mps) < 0.1f) continue;
    GetParam().with(answer);
    ++tried;
    const RayTruth truth = trace(world, ray);
    const Judgement judgement = compare(world, ray, RayMode::closest, false, truth, answer);
    rejected += judgement.verdict == Verdict::differs;
    EXPECT_NE(judgement.verdict, Verdict::agrees);
  }
  EXPECT_GT(tried, 200);
  // The others are at an edge or grazing, within the tolerance.
  EXPECT_GT(rejected, tried * 98 / 100);
}

INSTANTIATE_TEST_SUITE_P(
    All, CompareTamperedRay,
    testing::Values(Tampering{"miss", [](RayHit& hit) { hit = RayHit{}; }},
                    Tampering{"lambda", [](RayHit& hit) { hit.lambda = 1.002f * hit.lambda + 0.01f; }},
                    Tampering{"entity", [](RayHit& hit) { hit.entity.index = (hit.entity.index + 1) % 40; }},
                    Tampering{"generation", [](RayHit& hit) { hit.entity.generation = 2; }},
                    Tampering{"triangle", [](RayHit& hit) { hit.triangle ^= 1u; }},
                    Tampering{"no_such_triangle", [](RayHit& hit) { hit.triangle += 100'000; }},
                    Tampering{"u_and_v", [](RayHit& hit) { hit.u += 0.02f; }},
                    Tampering{"v", [](RayHit& hit) { hit.v = std::nanf(""); }},
                    Tampering{"front_face", [](RayHit& hit) { hit.front_face = !hit.front_face; }},
                    Tampering{"normal_side", [](RayHit& hit) { hit.n_world = -hit.n_world; }},
                    Tampering{"normal_length", [](RayHit& hit) { hit.n_world *= 1.01f; }},
                    Tampering{"velocity", [](RayHit& hit) { hit.v_relative_mps *= 1.05f; }},
                    Tampering{"velocity_nan", [](RayHit& hit) { hit.v_relative_mps.x = std::nanf(""); }},
                    Tampering{"incomplete", [](RayHit& hit) { hit.status = HitStatus::incomplete; }}),
    [](const auto& tampering) { return std::string(tampering.param.name); });

TEST(CompareRay, RejectsAHitBehindTheClosestOne) {
  Scene scene;
  scene.place(make_box({2, 2, 2}));
  scene.place(make_box({2, 2, 2}), at({0, 0, -5}));
  const World world = scene.world();
  const Ray ray = ray_from({0.3f, 0.2f, 10}, {0, 0, -1});
  Ray beyond = ray;
  beyond.lambda_min = 12.0f;
  RayHit answer = FloatTracer(scene)(beyond, false);
  ASSERT_EQ(answer.entity.index, 1u);
  EXPECT_EQ(compare(world, ray, RayMode::closest, false, trace(world, ray), answer).verdict,
            Verdict::differs);
}

TEST(CompareRay, RejectsAHitThatDoesNotExist) {
  Scene scene;
  scene.place(make_box({2, 2, 2}));
  const World world = scene.world();
  const RayHit answer = FloatTracer(scene)(ray_from({0.9f, 0.2f, 10}, {0, 0, -1}), false);
  const Ray beside = ray_from({1.01f, 0.2f, 10}, {0, 0, -1});
  EXPECT_EQ(compare(world, beside, RayMode::closest, false, trace(world, beside), answer).verdict,
            Verdict::differs);
  EXPECT_EQ(compare(world, beside, RayMode::any, false, trace(world, beside, RayMode::any), answer).verdict,
            Verdict::differs);
  // Out of range by more than rounding.
  Ray shorter = ray_from({0.9f, 0.2f, 10}, {0, 0, -1});
  shorter.lambda_max = 8.9f;
  EXPECT_EQ(compare(world, shorter, RayMode::closest, false, trace(world, shorter), answer).verdict,
            Verdict::differs);
  EXPECT_EQ(compare(world, shorter, RayMode::any, false, trace(world, shorter, RayMode::any), answer).verdict,
            Verdict::differs);
}

TEST(CompareRay, IsTooCloseAtAnEdge) {
  Scene scene;
  scene.place(make_box({2, 2, 2}));
  const World world = scene.world();
  const Ray at_rim = ray_from({1.0f, 0.2f, 10}, {0, 0, -1});
  const RayTruth truth = trace(world, at_rim);
  ASSERT_EQ(truth.status, HitStatus::hit);
  EXPECT_EQ(compare(world, at_rim, RayMode::closest, false, truth, RayHit{}).verdict, Verdict::too_close);
  const Ray just_off = ray_from({std::nextafter(1.0f, 2.0f), 0.2f, 10}, {0, 0, -1});
  const RayTruth miss = trace(world, just_off);
  ASSERT_EQ(miss.status, HitStatus::miss);
  RayHit answer = FloatTracer(scene)(ray_from({0.999999f, 0.2f, 10}, {0, 0, -1}), false);
  ASSERT_EQ(answer.status, HitStatus::hit);
  EXPECT_EQ(compare(world, just_off, RayMode::closest, false, miss, answer).verdict, Verdict::too_close);
}

}  // namespace
}  // namespace rtstdb::oracle
