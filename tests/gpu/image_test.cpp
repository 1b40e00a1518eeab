// Images without light: the first hits against ray queries, times of rows, motion vectors, and what is
// refused.

#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <numbers>
#include <vector>

#include <rtstdb/limits.hpp>

#include "tests/gpu/image_fixture.hpp"
#include "tests/gpu/random_queries.hpp"

namespace rtstdb::test {
namespace {

std::vector<Ray> rays_of(const Camera& camera, const Image& image) {
  std::vector<Ray> rays;
  for (std::uint32_t row = 0; row < image.height; ++row)
    for (std::uint32_t column = 0; column < image.width; ++column)
      rays.push_back(pixel_ray(camera, image.width, image.height, column, row));
  return rays;
}

TEST_F(ImageTest, FirstHitsAreThoseOfARayQuery) {
  EntityRow row = row_of(add(make_sphere(1.0)), {5.0, 0.0, 0.0});
  row.motion.v_world_mps = {0.0, 1.0, 0.5};
  const EntityId sphere = create(row);
  EntityRow wall = row_of(add(make_box({1.0, 20.0, 20.0})), {20.0, 0.0, 0.0});
  wall.motion.w_world_radps = {0.1, 0.0, 0.0};
  create(wall);
  const MaterialId material = add_material({.roughness = 0.5});
  row.material = material;
  execute([&](Transaction& transaction) { transaction.update(sphere, row); });
  for (const Nanoseconds row_time : {Nanoseconds(0), Nanoseconds(1'000'000)}) {
    const Camera camera{.p_m = {0.0f, 0.1f, 0.2f}, .t = at_s(0.25), .row_time = row_time};
    const Image& image = image_of(camera, {.width = 150, .height = 70, .outputs = first_hits});
    const std::vector<Ray> rays = rays_of(camera, image);
    const std::vector<RayHit> hits = trace(rays);
    std::size_t seen = 0, differ = 0;
    for (std::size_t i = 0; i < hits.size(); ++i) {
      const RayHit& hit = hits[i];
      seen += hit.entity == sphere ? 1 : 0;
      const bool is_seen = hit.status == HitStatus::hit;
      const bool is_same = hit.entity == image.entities[i] && hit.triangle == image.triangles[i] &&
                           hit.material == image.materials[i] &&
                           (is_seen ? std::abs(hit.lambda - image.depth_m[i]) <= 1e-6f * hit.lambda
                                    : std::isinf(image.depth_m[i]));
      differ += is_same ? 0 : 1;
    }
    EXPECT_GT(seen, 200u);
    // Rays of the host and of the device differ by rounding.
    EXPECT_LE(differ, hits.size() / 1000);
  }
}

/// Whether a neighbour of the pixel sees another entity, or nothing.
bool is_at_silhouette(const Image& image, std::uint32_t column, std::uint32_t row) {
  const EntityId own = image.entities[std::size_t{row} * image.width + column];
  for (std::uint32_t y = std::max(row, 1u) - 1; y < std::min(row + 2, image.height); ++y)
    for (std::uint32_t x = std::max(column, 1u) - 1; x < std::min(column + 2, image.width); ++x)
      if (image.entities[std::size_t{y} * image.width + x] != own) return true;
  return false;
}

TEST_F(ImageTest, RasterisedFirstHitsAreThoseThatAreTraced) {
  if (!database().device().draws) GTEST_FAIL() << "the device can not draw";
  Random random(91);
  const std::vector<GeometryId> shapes = {add(make_sphere(1.0, 3)), add(make_box({1.5, 0.7, 1.0})),
                                          add(make_cylinder(0.6, 2.0))};
  std::vector<EntityRow> rows;
  for (std::uint32_t k = 0; k < 400; ++k) {
    EntityRow row = row_of(shapes[k % shapes.size()], 12.0 * random.vector());
    row.scale = glm::dvec3(random.uniform(0.5, 2.0), random.uniform(0.5, 2.0), random.uniform(0.5, 2.0));
    row.motion.v_world_mps = random.vector();
    row.motion.w_world_radps = random.vector();
    row.mask = k % 5 == 0 ? 2u : 1u;
    rows.push_back(row);
  }
  const std::vector<EntityId> ids = create(rows);
  ImageQueryOptions options{.width = 200, .height = 150, .outputs = first_hits};
  std::size_t seen = 0, differ = 0, counted = 0, depth_differs = 0;
  for (std::uint32_t k = 0; k < 12; ++k) {
    Camera camera{.p_m = glm::vec3(6.0 * random.vector()),
                  .q = glm::quat(glm::vec3(1.0f, 0.0f, 0.0f), glm::vec3(random.direction())),
                  .horizontal_angle_rad = static_cast<float>(random.uniform(0.3, 2.0)),
                  .t = at_s(random.uniform(0.0, 3.0)),
                  .exposure = Nanoseconds(2'000'000),
                  .mask = k % 2 == 0 ? mask_all : 1u};
    if (k % 3 == 0) camera.carrier = ids[k];
    options.first_hits = FirstHits::traced;
    const Image traced = image_of(camera, options);
    const std::vector<EntityId> entities(traced.entities.begin(), traced.entities.end());
    const std::vector<std::uint32_t> triangles(traced.triangles.begin(), traced.triangles.end());
    const std::vector<float> depths_m(traced.depth_m.begin(), traced.depth_m.end());
    options.first_hits = FirstHits::rasterised;
    const Image& drawn = image_of(camera, options);
    for (std::uint32_t i = 0; i < entities.size(); ++i) {
      if (is_at_silhouette(drawn, i % drawn.width, i / drawn.width)) continue;
      ++counted;
      seen += entities[i].valid() ? 1 : 0;
      const bool is_same = entities[i] == drawn.entities[i] && triangles[i] == drawn.triangles[i];
      differ += is_same ? 0 : 1;
      if (is_same && entities[i].valid())
        depth_differs += std::abs(depths_m[i] - drawn.depth_m[i]) > 1e-6f * depths_m[i] ? 1 : 0;
    }
  }
  EXPECT_GT(seen, 50'000u);
  EXPECT_LE(differ, counted / 1000);
  EXPECT_EQ(depth_differs, 0u);
}

TEST_F(ImageTest, WithoutARasteriserFirstHitsAreTraced) {
  gpu::DeviceOptions device;
  device.draws = false;
  open({}, device);
  EXPECT_FALSE(database().device().draws);
  const EntityId box = create(row_of(add(make_box({1.0, 1.0, 1.0})), {5.0, 0.0, 0.0}));
  const Image& image =
      image_of({}, {.width = 9, .height = 9, .outputs = first_hits, .first_hits = FirstHits::rasterised});
  EXPECT_EQ(image.entities[4 * 9 + 4], box);
}

TEST_F(ImageTest, NormalsFaceTheCamera) {
  create(row_of(add(make_box({4.0, 4.0, 4.0}))));
  for (const float x_m : {-10.0f, 0.0f}) {  // outside and inside
    const Image& image =
        image_of({.p_m = {x_m, 0.0f, 0.0f}}, {.width = 16, .height = 16, .outputs = first_hits});
    EXPECT_EQ(image.normals[8 * 16 + 8], glm::vec3(-1.0f, 0.0f, 0.0f));
  }
}

TEST_F(ImageTest, SurfacesNearerThanNearAreNotSeen) {
  create(row_of(add(make_rectangle(1.0, 1.0)), {}));
  const glm::quat down = glm::angleAxis(std::numbers::pi_v<float> / 2.0f, glm::vec3(0.0f, 1.0f, 0.0f));
  for (const float near_m : {0.1f, 0.3f}) {
    const Image& image = image_of({.p_m = {0.1f, 0.05f, 0.2f}, .q = down, .near_m = near_m},
                                  {.width = 8, .height = 8, .outputs = first_hits});
    EXPECT_EQ(image.entities[3 * 8 + 3].valid(), near_m < 0.2f);
  }
}

TEST_F(ImageTest, ARollingShutterShearsAMovingBox) {
  const double speed_mps = 4.0, depth_m = 9.5, row_s = 1e-3;
  EntityRow row = row_of(add(make_box({1.0, 1.0, 30.0})), {10.0, 2.0, 0.0});
  row.motion.v_world_mps = {0.0, -speed_mps, 0.0};
  create(row);
  const std::uint32_t width = 320, height = 200;
  const Camera camera{.t = at_s(0.0), .row_time = Nanoseconds(static_cast<std::int64_t>(row_s * 1e9))};
  const Image& image = image_of(camera, {.width = width, .height = height, .outputs = first_hits});
  const double pixels_per_m = width / 2.0 / std::tan(0.5) / depth_m;
  for (std::uint32_t r = 0; r < height; ++r) {
    std::uint32_t first = 0;
    while (first < width && !image.entities[std::size_t{r} * width + first].valid())
      ++first;
    const double offset_m = 2.5 - speed_mps * row_s * r;  // of the box, to the left
    EXPECT_NEAR(first, width / 2.0 - offset_m * pixels_per_m, 1.0) << r;
  }
}

/// Where a point of the world is in the image, in pixels.
glm::dvec2 projected(const Camera& camera, const Pose& carrier, const glm::dvec3& point_m, double per_slope) {
  const glm::dvec3 at_m = carrier.p_world_m + carrier.q_world * glm::dvec3(camera.p_m);
  const glm::dquat q = carrier.q_world * glm::normalize(glm::dquat(camera.q));
  const glm::dvec3 seen = glm::inverse(q) * (point_m - at_m);
  return -per_slope * glm::dvec2(seen.y, seen.z) / seen.x;
}

TEST_F(ImageTest, MotionIsThatOfTheSurfaceInTheImage) {
  EntityRow row = row_of(add(make_sphere(1.0)), {6.0, 0.5, -0.3});
  row.motion.v_world_mps = {1.0, 2.0, -1.0};
  row.motion.w_world_radps = {0.5, -1.0, 2.0};
  const EntityId body = create(row);
  EntityRow carrier_row;
  carrier_row.motion.v_world_mps = {0.5, -1.0, 0.25};
  carrier_row.motion.w_world_radps = {0.1, 0.2, -0.3};
  const EntityId carrier = create(carrier_row);
  const WorldTime t = at_s(0.125);
  const std::uint32_t width = 64, height = 48;
  const Camera camera{.p_m = {0.3f, 0.1f, -0.2f},
                      .q = glm::angleAxis(0.1f, glm::normalize(glm::vec3(1.0f, 2.0f, -1.0f))),
                      .t = t,
                      .carrier = carrier};
  const Image& image = image_of(camera, {.width = width, .height = height, .outputs = first_hits});
  const double per_slope = width / 2.0 / std::tan(0.5);
  const Nanoseconds step(100'000);
  std::size_t seen = 0;
  for (std::uint32_t i = 0; i < width * height; ++i) {
    if (image.entities[i] != body) continue;
    ++seen;
    const Ray ray = pixel_ray(camera, width, height, i % width, i / width);
    const Pose carried = pose_at(carrier_row.motion, t);
    const glm::dvec3 point_m =
        carried.p_world_m +
        carried.q_world *
            (glm::dvec3(ray.origin_m) + static_cast<double>(image.depth_m[i]) * glm::dvec3(ray.direction));
    const Pose then = pose_at(row.motion, t);
    const glm::dvec3 in_body = glm::inverse(then.q_world) * (point_m - then.p_world_m);
    const auto pixel_at = [&](WorldTime instant) {
      const Pose pose = pose_at(row.motion, instant);
      return projected(camera, pose_at(carrier_row.motion, instant), pose.p_world_m + pose.q_world * in_body,
                       per_slope);
    };
    const glm::dvec2 expected = (pixel_at(t + step) - pixel_at(t - step)) / 2e-4;
    EXPECT_LT(glm::length(expected - glm::dvec2(image.motion_px_s[i])), 1e-3 * glm::length(expected) + 1e-2);
  }
  EXPECT_GT(seen, 100u);
}

TEST_F(ImageTest, LastsAtMostTheLongestWindow) {
  const auto query = prepare(ImageQueryOptions{.name = "rows", .width = 8, .height = 11});
  query->cameras()[0] = {.row_time = Nanoseconds(max_query_window_ns / 10)};
  EXPECT_TRUE(run(*query, 1).done());
  query->cameras()[0].exposure = Nanoseconds(1);
  EXPECT_EQ(run(*query, 1).bad_input.reason, BadInputReason::bad_camera);
  query->cameras()[0].exposure = Nanoseconds(max_query_window_ns / 2);
  EXPECT_EQ(describe(run(*query, 1)),
            "bad_input: time from the first to the last instant of the image is 1.5 s; it must be 0 to 1 s, "
            "in element 0 of query 0; nothing was done");
}

TEST_F(ImageTest, RefusesBadOptionsWithValueAndLimit) {
  const ImageQueryOptions good{.name = "camera", .width = 4, .height = 4};
  EXPECT_EQ(refusal(good), "");
  auto bad = good;
  bad.width = 0;
  EXPECT_EQ(refusal(bad), "image query 'camera' asks for a width in pixels of 0; 1 to 16384 are possible");
  bad = good;
  bad.height = max_image_side + 1;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' asks for a height in pixels of 16385; 1 to 16384 are possible");
  bad = good;
  bad.width = bad.height = max_image_side;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' asks for a number of pixels in all images of 268435456; 1 to 67108864 are "
            "possible");
  bad = good;
  bad.samples_per_pixel = 0;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' asks for a number of samples of a pixel of 0; 1 to 65536 are possible");
  bad = good;
  bad.bounces = 65;
  EXPECT_EQ(refusal(bad), "image query 'camera' asks for a number of bounces of 65; 0 to 64 are possible");
  bad = good;
  bad.emitter_points = 257;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' asks for a number of zones of an emitting entity of 257; 1 to 256 are "
            "possible");
  bad = good;
  bad.lobe_rays = 0;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' asks for a number of rays into a lobe of 0; 1 to 256 are possible");
  bad = good;
  bad.width = bad.height = 8192;
  bad.samples_per_pixel = max_image_samples;
  bad.bounces = max_image_bounces;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' asks for stages, for its pixels times samples times bounces, of "
            "13153337345; 1 to 4294967295 are possible");
  bad = good;
  bad.outputs = {.srgb = false};
  EXPECT_EQ(refusal(bad), "image query 'camera' has no output");
}

TEST_F(ImageTest, RefusesBadFixedLights) {
  const auto refusal_of = [&](const FixedLight& light, std::size_t count = 1) {
    return refusal(
        {.name = "camera", .width = 4, .height = 4, .fixed_lights = std::vector<FixedLight>(count, light)});
  };
  const Light sun{.kind = LightKind::directional, .illuminance_lx = 1e4};
  EXPECT_EQ(refusal_of({.light = sun}), "");
  EXPECT_EQ(refusal_of({.light = sun}, 17),
            "image query 'camera' asks for a number of fixed lights of 17; 0 to 16 are possible");
  EXPECT_EQ(refusal_of({.light = {.kind = LightKind::point, .intensity_cd = 1.0}}),
            "image query 'camera', fixed light 0: its kind is point; allowed are directional and sky");
  EXPECT_EQ(refusal_of({.light = {.kind = LightKind::directional}}),
            "image query 'camera', fixed light 0: " +
                validate_light({.kind = LightKind::directional}).error().message);
  EXPECT_EQ(
      refusal_of({.light = sun, .q_world = {0.0f, 0.0f, 0.0f, 0.0f}}),
      "image query 'camera', fixed light 0: the length of q_world is 0.000000; allowed are 1e-6 to 1e6");
}

TEST_F(ImageTest, RefusesShadowMapsThatItCanNotDraw) {
  const ImageQueryOptions good{.name = "camera",
                               .width = 4,
                               .height = 4,
                               .mode = ImageMode::real_time,
                               .first_hits = FirstHits::rasterised,
                               .shadows = Shadows::mapped};
  EXPECT_EQ(refusal(good), "");
  auto bad = good;
  bad.mode = ImageMode::path_traced;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' has shadows 'mapped', which need the mode 'real_time' and first hits "
            "'rasterised'; it has 'path_traced' and 'rasterised'");
  bad = good;
  bad.first_hits = FirstHits::traced;
  EXPECT_NE(refusal(bad).find("it has 'real_time' and 'traced'"), std::string::npos);
  bad = good;
  bad.shadow_map_side = 63;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' asks for a side of shadow maps in texels of 63; 64 to 8192 are possible");
  bad = good;
  bad.shadow_maps = 65;
  EXPECT_EQ(refusal(bad),
            "image query 'camera' asks for a number of shadow maps of 65; 1 to 64 are possible");
}

TEST_F(ImageTest, RefusesBadCamerasWithValueAndLimits) {
  create(row_of(add(make_box({1.0, 1.0, 1.0}))));
  const auto query = prepare(ImageQueryOptions{.name = "camera", .width = 4, .height = 8});
  const auto fault = [&](const Camera& camera) {
    query->cameras()[0] = camera;
    return run(*query, 1).bad_input;
  };
  EXPECT_EQ(fault({}).reason, BadInputReason::none);
  for (const double angle_deg : {0.0, 180.0, 270.0, -20.0, std::nan("")}) {
    const BadInput bad = fault({.horizontal_angle_rad = static_cast<float>(glm::radians(angle_deg))});
    EXPECT_EQ(bad.reason, BadInputReason::bad_camera) << angle_deg;
    EXPECT_EQ(bad.field, "horizontal_angle_rad");
    EXPECT_LT(bad.highest, std::numbers::pi);
  }
  EXPECT_EQ(fault({.q = glm::quat(0.0f, 0.0f, 0.0f, 0.0f)}).field, "length of q");
  EXPECT_EQ(fault({.near_m = 0.0f}).field, "near_m");
  EXPECT_EQ(fault({.row_time = Nanoseconds(-1)}).field, "row_time");
  EXPECT_EQ(fault({.exposure = Nanoseconds(-1)}).field, "exposure");
  const auto sentence = [&](const Camera& camera) {
    query->cameras()[0] = camera;
    return describe(run(*query, 1));
  };
  const auto expect_sentence = [&](const Camera& camera, const char* part) {
    EXPECT_NE(sentence(camera).find(part), std::string::npos) << sentence(camera);
  };
  expect_sentence({.row_time = Nanoseconds(-1)}, "row_time is -1e-09 s; it must be 0 to 1 s");
  expect_sentence({.exposure = Nanoseconds(1'500'000'000)}, "exposure is 1.5 s; it must be 0 to 1 s");
  expect_sentence({.row_time = Nanoseconds(200'000'000)},
                  "time from the first to the last instant of the image is 1.4 s; it must be 0 to 1 s");
  expect_sentence({.near_m = 0.0f}, "near_m is 0; it must be 0.0001 to 10000");
  for (const double limit_m : {min_image_near_m, max_image_near_m}) {
    query->cameras()[0] = {.near_m = static_cast<float>(limit_m)};
    EXPECT_TRUE(run(*query, 1).done()) << limit_m << " m is allowed";
  }
  const auto drawn = prepare(
      ImageQueryOptions{.name = "drawn", .width = 4, .height = 8, .first_hits = FirstHits::rasterised});
  drawn->cameras()[0] = {.row_time = Nanoseconds(1)};
  EXPECT_EQ(run(*drawn, 1).bad_input.field, "row_time");
  EXPECT_EQ(fault({.exposure_value = 40.0f}).field, "exposure_value");
  EXPECT_EQ(fault({.p_m = {1e6f, 0.0f, 0.0f}}).reason, BadInputReason::out_of_limits);
  EXPECT_EQ(fault({.carrier = {7, 0}}).reason, BadInputReason::unknown_entity);
  EXPECT_EQ(fault({.t = at_s(-1.0)}).reason, BadInputReason::time_not_covered);
}

}  // namespace
}  // namespace rtstdb::test
