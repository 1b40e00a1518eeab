// The paper's Figure 8: the length of a passing body as a scanner measures it.

#include <gtest/gtest.h>

#include <limits>

#include "scene.hpp"

namespace rtstdb::oracle {
namespace {

constexpr double length_m = 4.5;
constexpr double width_m = 1.8;

/// The first and the last beam that hit the near side of the body.
struct NearSideHits {
  double first_s = std::numeric_limits<double>::infinity();
  double last_s = -std::numeric_limits<double>::infinity();
  double first_y_m = 0.0, last_y_m = 0.0;
  void add(double t_s, double y_m) {
    if (t_s < first_s) {
      first_s = t_s;
      first_y_m = y_m;
    }
    if (t_s > last_s) {
      last_s = t_s;
      last_y_m = y_m;
    }
  }
};

/// A car that passes along y; its near side lies in the plane x = near_m.
Scene passing_car(double near_m, double y_m, double speed_mps) {
  Motion motion = at({near_m + 0.5 * width_m, y_m, 0.0});
  motion.v_world_mps = {0.0, speed_mps, 0.0};
  Scene scene;
  scene.place(make_box({width_m, length_m, 1.5}), motion);
  return scene;
}

TEST(LineScanner, MeasuresTheLengthOverOneMinusTheSpeedRatio) {
  // Parallel beams, one after the other along y: exactly L / (1 - v / v_scan).
  const double v_scan_mps = 40.0;
  for (const double v_mps : {-20.0, -5.0, 0.0, 5.0, 20.0}) {
    const World world = passing_car(10.0, 0.0, v_mps).world();
    for (const bool ignore_motion : {false, true}) {
      NearSideHits hits;
      constexpr double pitch_s = 1e-4;
      for (int i = -4000; i <= 4000; ++i) {
        const double t_s = i * pitch_s;
        const auto y_m = static_cast<float>(v_scan_mps * t_s);
        if (trace(world, ray_from({0, y_m, 0}, {1, 0, 0}, at_s(t_s)), RayMode::any, ignore_motion).status ==
            HitStatus::hit)
          hits.add(t_s, static_cast<double>(y_m));
      }
      const double expected_m = ignore_motion ? length_m : length_m / (1.0 - v_mps / v_scan_mps);
      EXPECT_NEAR(hits.last_y_m - hits.first_y_m, expected_m, 2.0 * v_scan_mps * pitch_s) << v_mps;
    }
  }
}

/// The paper's scanner: 140 degrees in one second, on a carrier that turns with the beam.
class TurningScanner {
 public:
  static constexpr double rate_radps = 140.0 / 180.0 * pi;
  static constexpr double start_rad = -0.5 * rate_radps;
  static constexpr int beams = 1920;
  static constexpr double pitch_s = 1.0 / beams;

  static double angle_rad(double t_s) { return start_rad + rate_radps * t_s; }

  /// A scan of the near side x = near_m, by a carried beam.
  static NearSideHits scan(Scene scene, double near_m, bool ignore_motion) {
    Motion mount;
    mount.q_world = glm::angleAxis(start_rad, glm::dvec3(0, 0, 1));
    mount.w_world_radps = {0, 0, rate_radps};
    scene.place(make_box({0.1, 0.1, 0.1}), mount).mask = 0;
    const World world = scene.world();
    NearSideHits hits;
    for (int i = 0; i < beams; ++i) {
      const double t_s = i * pitch_s;
      Ray ray = ray_from({0, 0, 0}, {1, 0, 0}, at_s(t_s));
      if (ignore_motion) {
        // Carriers do not move either: the direction of the beam has to turn.
        ray.direction = glm::vec3(std::cos(angle_rad(t_s)), std::sin(angle_rad(t_s)), 0.0);
      } else {
        ray.carrier = scene.last();
      }
      const RayTruth hit = trace(world, ray, RayMode::closest, ignore_motion);
      if (hit.status == HitStatus::hit && hit.n_world.x < -0.5)
        hits.add(t_s, near_m * std::tan(angle_rad(t_s)));
    }
    return hits;
  }

  /// The instant at which the beam meets an edge that starts at y_m and moves at v_mps, by bisection.
  static double edge_hit_s(double near_m, double y_m, double v_mps) {
    double before = 0.0;
    double after = 1.0;
    for (int i = 0; i < 100; ++i) {
      const double t_s = 0.5 * (before + after);
      (near_m * std::tan(angle_rad(t_s)) < y_m + v_mps * t_s ? before : after) = t_s;
    }
    return before;
  }
};

TEST(TurningScanner, MeasuresTheLengthBetweenTheEdgeInstants) {
  const double near_m = 12.0;
  for (const double v_mps : {-15.0, -8.0, 0.0, 8.0, 15.0}) {
    for (const double y_m : {-8.0, 0.0, 6.0}) {
      const double start_m = y_m - 0.5 * v_mps;  // at y_m in the middle of the scan
      const NearSideHits hits = TurningScanner::scan(passing_car(near_m, start_m, v_mps), near_m, false);
      const double first_s = TurningScanner::edge_hit_s(near_m, start_m - 0.5 * length_m, v_mps);
      const double last_s = TurningScanner::edge_hit_s(near_m, start_m + 0.5 * length_m, v_mps);
      EXPECT_GE(hits.first_s, first_s - 1e-9);
      EXPECT_LE(hits.first_s, first_s + TurningScanner::pitch_s + 1e-9);
      EXPECT_LE(hits.last_s, last_s + 1e-9);
      EXPECT_GE(hits.last_s, last_s - TurningScanner::pitch_s - 1e-9);

      const double expected_m = near_m * (std::tan(TurningScanner::angle_rad(last_s)) -
                                          std::tan(TurningScanner::angle_rad(first_s)));
      const double steepest_rad =
          std::max(std::abs(TurningScanner::angle_rad(first_s)), std::abs(TurningScanner::angle_rad(last_s)));
      const double pitch_m =
          near_m * TurningScanner::rate_radps * TurningScanner::pitch_s / std::pow(std::cos(steepest_rad), 2);
      EXPECT_NEAR(hits.last_y_m - hits.first_y_m, expected_m, 2.0 * pitch_m) << v_mps << " " << y_m;
      // Longer if it moves with the beam, shorter if it moves against it.
      if (v_mps > 0.0) {
        EXPECT_GT(expected_m, length_m);
      }
      if (v_mps < 0.0) {
        EXPECT_LT(expected_m, length_m);
      }
    }
  }
}

TEST(TurningScanner, MeasuresTheTrueLengthWithoutMotion) {
  const double near_m = 12.0;
  for (const double v_mps : {-15.0, 15.0}) {
    const NearSideHits hits = TurningScanner::scan(passing_car(near_m, 1.0, v_mps), near_m, true);
    EXPECT_NEAR(hits.last_y_m - hits.first_y_m, length_m, 2.0 * 0.02);
  }
}

}  // namespace
}  // namespace rtstdb::oracle
