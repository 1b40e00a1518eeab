#include "bench/images/crossing.hpp"

#include <glm/gtc/packing.hpp>
#include <glm/gtc/quaternion.hpp>

#include <cmath>
#include <stdexcept>
#include <string>

#include "bench/spatial/our_world.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {
namespace {

/// Samples of a pixel of the path tracer: its noise is still visible.
constexpr std::uint32_t samples = 16;

struct Block {
  glm::dvec3 size_m, center_m;
  glm::dvec3 color;
};

/// Ground, roads and houses of configs/crossing, and boxes for its vehicles.
constexpr Block blocks[] = {
    {{300.0, 300.0, 1.0}, {0.0, 0.0, -0.55}, {0.25, 0.35, 0.15}},
    {{300.0, 7.0, 0.1}, {0.0, 0.0, -0.05}, {0.2, 0.2, 0.2}},
    {{7.0, 300.0, 0.1}, {0.0, 0.0, -0.05}, {0.2, 0.2, 0.2}},
    {{30.0, 20.0, 9.0}, {-35.0, -32.0, 4.5}, {0.6, 0.5, 0.4}},
    {{30.0, 22.0, 12.0}, {-35.0, 34.0, 6.0}, {0.6, 0.6, 0.6}},
    {{26.0, 24.0, 10.0}, {30.0, -30.0, 5.0}, {0.5, 0.3, 0.25}},
    {{28.0, 20.0, 8.0}, {32.0, 28.0, 4.0}, {0.6, 0.55, 0.5}},
    {{4.5, 1.8, 1.4}, {-20.0, -1.75, 0.75}, {0.1, 0.2, 0.5}},
    {{1.8, 4.5, 1.4}, {1.75, -8.0, 0.75}, {0.6, 0.1, 0.1}},
    {{1.8, 4.5, 1.4}, {-1.75, 14.0, 0.75}, {0.7, 0.7, 0.7}},
    {{1.8, 4.5, 1.4}, {1.75, -30.0, 0.75}, {0.5, 0.5, 0.1}},
};

glm::dquat turned(double yaw_rad, double pitch_rad) {
  return glm::angleAxis(yaw_rad, glm::dvec3(0.0, 0.0, 1.0)) *
         glm::angleAxis(pitch_rad, glm::dvec3(0.0, 1.0, 0.0));
}

/// Over the crossing; each needs one shadow map.
constexpr int lamps = 4;

/// A sunny day, with a sun and a sky.
void fill_crossing(OurWorld& world, bool has_lamps) {
  std::vector<rtstdb::EntityRow> rows;
  for (const Block& block : blocks) {
    rtstdb::EntityRow& row = rows.emplace_back();
    row.geometry = world.add(rtstdb::make_box(block.size_m));
    row.material = must(world.database().add_material({.base_color = block.color}, "block"));
    row.motion.p_world_m = block.center_m;
  }
  rtstdb::EntityRow& sun = rows.emplace_back();
  sun.light = must(world.database().add_light(
      {.kind = rtstdb::LightKind::directional, .illuminance_lx = 8e4, .angular_diameter_rad = 0.0093},
      "sun"));
  sun.motion.q_world = turned(0.6, 0.8);
  rtstdb::EntityRow& sky = rows.emplace_back();
  sky.light = must(world.database().add_light({.kind = rtstdb::LightKind::sky,
                                               .zenith_cdpm2 = {2000.0, 3500.0, 6000.0},
                                               .horizon_cdpm2 = {6000.0, 7000.0, 8000.0},
                                               .ground_cdpm2 = glm::dvec3(1000.0)},
                                              "sky"));
  for (int k = 0; has_lamps && k < lamps; ++k) {
    rtstdb::EntityRow& lamp = rows.emplace_back();
    lamp.light = must(world.database().add_light({.kind = rtstdb::LightKind::spot,
                                                  .intensity_cd = 1e5,
                                                  .inner_angle_rad = 1.0,
                                                  .outer_angle_rad = 1.5},
                                                 "lamp"));
    lamp.motion.p_world_m = {-20.0 + 8.0 * k, 4.0, 7.0};
    lamp.motion.q_world = turned(0.0, 1.3);
  }
  world.create(rows);
}

PreparedBatch<rtstdb::ImageQuery> prepare_image(OurWorld& world, const SuiteOptions& options,
                                                rtstdb::ImageMode mode, std::uint32_t bounces,
                                                rtstdb::Shadows shadows) {
  const bool real_time = mode == rtstdb::ImageMode::real_time;
  auto query = must(world.database().prepare(rtstdb::ImageQueryOptions{
      .name = "crossing",
      .width = options.tiny ? 64u : 640u,
      .height = options.tiny ? 48u : 480u,
      .mode = mode,
      .outputs = {.color = true, .srgb = true},
      .first_hits = real_time ? rtstdb::FirstHits::rasterised : rtstdb::FirstHits::traced,
      .samples_per_pixel = real_time ? 1 : samples,
      .bounces = bounces,
      .shadows = shadows}));
  query->cameras()[0] = {.p_m = {-44.0f, -1.75f, 6.0f},
                         .q = glm::quat(turned(0.0, 0.12)),
                         .horizontal_angle_rad = 1.2f,
                         .exposure_value = 14.0f};
  return {world.database(), std::move(query), 1};
}

double mean_luminance(const rtstdb::Image& image) {
  double sum = 0.0;
  for (const rtstdb::HalfColor& color : image.color)
    sum += static_cast<double>(glm::unpackHalf1x16(color[1]));
  return sum / static_cast<double>(image.color.size());
}

using PreparedImage = PreparedBatch<rtstdb::ImageQuery>;

/// `tolerance`: of the mean luminances.
Figure compare(const std::string& name, PreparedImage image, PreparedImage peer, const std::string& peer_name,
               double tolerance, int rounds) {
  image.run();
  peer.run();
  const double ours = mean_luminance(image.query().images()[0]);
  const double theirs = mean_luminance(peer.query().images()[0]);
  if (std::abs(ours - theirs) > tolerance * theirs)
    throw std::runtime_error(name + ": the mean luminance is " + std::to_string(ours) +
                             " cd/m2, that of the " + peer_name + " " + std::to_string(theirs));
  return time_figure(name,
                     in_turns(
                         rounds, [&] { image.run(); }, [&] { peer.run(); }),
                     peer_name);
}

Figure beside_path_tracer(OurWorld& world, const SuiteOptions& options, const std::string& name,
                          std::uint32_t bounces) {
  using enum rtstdb::ImageMode;
  using enum rtstdb::Shadows;
  return compare(name, prepare_image(world, options, real_time, bounces, mapped),
                 prepare_image(world, options, path_traced, bounces, traced), "path tracer, 16 samples", 0.15,
                 options.tiny ? 1 : 3);
}

Figure mapped_beside_traced_shadows(const SuiteOptions& options) {
  using enum rtstdb::ImageMode;
  using enum rtstdb::Shadows;
  OurWorld world(1024);
  fill_crossing(world, true);
  return compare("shadow_maps", prepare_image(world, options, real_time, 1, mapped),
                 prepare_image(world, options, real_time, 1, traced), "the same image, traced shadows", 0.01,
                 options.tiny ? 1 : 9);
}

}  // namespace

std::vector<Figure> measure_crossing(const SuiteOptions& options) {
  OurWorld world(1024);
  fill_crossing(world, false);
  return {beside_path_tracer(world, options, "image_crossing_640x480", 1),
          beside_path_tracer(world, options, "image_crossing_640x480_bounce", 2),
          mapped_beside_traced_shadows(options)};
}

}  // namespace hil::bench
