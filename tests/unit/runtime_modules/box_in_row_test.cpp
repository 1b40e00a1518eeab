// Where the rays of pixels are inside a moving box, against rtstdb::pixel_ray and points that are sampled
// along the rays.

#include "runtime/modules/camera/box_in_row.hpp"

#include <glm/gtc/quaternion.hpp>
#include <gtest/gtest.h>

#include <random>

#include <rtstdb/query.hpp>

namespace hil::modules {
namespace {

using rtstdb::world_time_ns;

TEST(BoxInRow, OfABoxAheadHasItsColumnsAndDepths) {
  // A camera of 90 degrees: at the depth 10 m the image is 20 m wide, 2 m for each pixel.
  const CameraView view{.camera = {.horizontal_angle_rad = 1.5707964f}, .width = 10, .height = 10};
  const BodyBox box{.motion = {.p_world_m = {11.0, 3.0, -1.0}}, .half_m = {1.0, 1.0, 1.0}};
  const BoxInRow row(view, box, 5);  // its middle is 1 m below the axis at the depth of 10 m
  // The front face is from y = 2 m to y = 4 m, columns 3 to 4; the back is nearer to the middle.
  EXPECT_EQ(row.first_column(), 2U) << "the enlarged box begins beyond the border of column 3";
  EXPECT_EQ(row.end_column(), 5U);
  const auto depths = row.depths(3);  // its ray has the slope 0.3
  ASSERT_TRUE(depths);
  EXPECT_NEAR(depths->first_m, 10.0, 0.005);
  EXPECT_NEAR(depths->last_m, 12.0, 0.005);
  const auto beside = row.depths(2);  // 0.5: at y = 5 m where the box begins
  EXPECT_FALSE(beside);
  const auto lower = row.depths(4);  // 0.1: y = 1.2 m where the box ends
  EXPECT_FALSE(lower);
  const BoxInRow above(view, box, 1);
  EXPECT_EQ(above.end_column(), 0U) << "no column";
}

TEST(BoxInRow, BehindOrAroundTheCameraBeginsAtTheNearDepth) {
  CameraView view{.camera = {.horizontal_angle_rad = 1.0f}, .width = 8, .height = 8};
  view.camera.near_m = 0.5f;
  const BoxInRow around(view, {.motion = {}, .half_m = {2.0, 2.0, 2.0}}, 4);
  EXPECT_EQ(around.first_column(), 0U);
  EXPECT_EQ(around.end_column(), 8U);
  ASSERT_TRUE(around.depths(4));
  EXPECT_DOUBLE_EQ(around.depths(4)->first_m, 0.5);
  EXPECT_NEAR(around.depths(4)->last_m, 2.0, 0.01);
  const BoxInRow behind(view, {.motion = {.p_world_m = {-5.0, 0.0, 0.0}}, .half_m = {2.0, 2.0, 2.0}}, 4);
  for (std::uint32_t column = 0; column < 8; ++column)
    EXPECT_FALSE(behind.depths(column));
}

/// A random camera on a random carrier, and a random box: both move and turn during the image.
TEST(BoxInRow, ContainsEveryPointOfTheBoxOnTheRaysOfMovingCameras) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto vector = [&](double size) {
    return size * glm::dvec3(unit(random), unit(random), unit(random));
  };
  const auto motion = [&](double size) {
    return rtstdb::Motion{.p_world_m = vector(size),
                          .q_world = glm::normalize(glm::dquat(unit(random), vector(1.0))),
                          .v_world_mps = vector(20.0),
                          .w_world_radps = vector(3.0),
                          .valid_from = world_time_ns(0)};
  };
  int inside = 0, outside_depths = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const rtstdb::Motion carrier = motion(10.0);
    const CameraView view{.camera = {.p_m = glm::vec3(vector(1.0)),
                                     .q = glm::normalize(glm::quat(glm::dquat(unit(random), vector(1.0)))),
                                     .horizontal_angle_rad = 1.2f,
                                     .t = world_time_ns(50'000'000),
                                     .row_time = rtstdb::Nanoseconds(2'000'000),
                                     .exposure = rtstdb::Nanoseconds(1'000'000),
                                     .carrier = {0, 1}},
                          .carrier = carrier,
                          .width = 32,
                          .height = 24};
    const BodyBox box{.motion = motion(10.0), .center_m = vector(1.0), .half_m = glm::abs(vector(4.0))};
    for (std::uint32_t row = 0; row < view.height; row += 5) {
      const BoxInRow found(view, box, row);
      for (std::uint32_t column = 0; column < view.width; ++column) {
        const rtstdb::Ray ray = rtstdb::pixel_ray(view.camera, view.width, view.height, column, row);
        const rtstdb::Pose eye = rtstdb::pose_at(carrier, ray.t), body = rtstdb::pose_at(box.motion, ray.t);
        const auto depths = found.depths(column);
        const bool in_columns = column >= found.first_column() && column < found.end_column();
        for (std::uint32_t step = 0; step < 80; ++step) {
          const double depth_m = 0.25 + 0.5 * step;
          const glm::dvec3 p_world =
              eye.p_world_m + eye.q_world * (glm::dvec3(ray.origin_m) + depth_m * glm::dvec3(ray.direction));
          const glm::dvec3 p = glm::conjugate(body.q_world) * (p_world - body.p_world_m) - box.center_m;
          const bool is_inside = glm::all(glm::lessThanEqual(glm::abs(p), box.half_m));
          const bool in_depths = depths && depth_m >= depths->first_m && depth_m <= depths->last_m;
          inside += is_inside ? 1 : 0;
          outside_depths += !is_inside && in_depths && in_columns ? 1 : 0;
          ASSERT_TRUE(!is_inside || (in_columns && in_depths))
              << "trial " << trial << ", row " << row << ", column " << column << ", depth " << depth_m;
        }
      }
    }
  }
  EXPECT_GT(inside, 10'000);
  EXPECT_LT(outside_depths, inside / 100) << "the box is enlarged by little";
}

}  // namespace
}  // namespace hil::modules
