// The pixels of a study, its work, and what it concludes.

#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <vector>

#include "configs/docking/modules/pixel_study/study_result.hpp"
#include "configs/docking/modules/pixel_study/study_work.hpp"

namespace hil::modules {
namespace {

constexpr double degree = std::numbers::pi / 180.0;

StudyOptions options_with(std::vector<PixelMethod> methods) {
  StudyOptions options;
  options.reflector_m = 0.004;
  options.port_radius_m = 1.0;
  options.distances_m = {20.0, 200.0};
  options.methods = std::move(methods);
  options.pixels = 1080;
  options.field_of_view_rad = 40.0 * degree;
  options.shifts = 10;
  options.needed_shifts = 9;
  options.all_pixels_up_to_samples = 1;
  options.share_beside_port = 0.01;
  return options;
}

PixelGrid grid_of(const StudyOptions& options) {
  return PixelGrid(options.pixels, options.field_of_view_rad);
}

const StudyScene scene{.port_m = {3.0, 2.0, 1.0}, .axis = {0.0, 1.0, 0.0}, .reflector_m = {3.52, 2.0, 1.66}};

TEST(PixelGrid, PlacesAndDirectionsAreInverse) {
  const PixelGrid grid(1080, 40.0 * degree);
  EXPECT_NEAR(grid.pitch_rad(), 0.037037 * degree, 1e-9);
  for (const glm::dvec2& place : {glm::dvec2(0.0, 0.0), glm::dvec2(540.0, 540.0), glm::dvec2(1000.25, 3.5)}) {
    const glm::dvec3 direction = grid.direction(place);
    EXPECT_NEAR(glm::length(direction), 1.0, 1e-14);
    EXPECT_LT(glm::length(grid.place(direction) - place), 1e-9);
  }
  EXPECT_LT(glm::length(grid.direction({540.0, 540.0}) - glm::dvec3(1.0, 0.0, 0.0)), 1e-14);
  EXPECT_GT(grid.direction({0.0, 540.0}).y, 0.3) << "column 0 is at the left";
  EXPECT_GT(grid.direction({540.0, 0.0}).z, 0.3) << "row 0 is at the top";
}

/// The paper's example: 4 mm, 40 degrees, 1080 pixels, 64 x 64 samples: about 200 m.
TEST(PixelGrid, Equation2GivesThePapersDistance) {
  const PixelGrid grid(1080, 40.0 * degree);
  EXPECT_NEAR(equation_2_distance_m(grid, 0.004, 64), 198.0, 0.1);
  EXPECT_NEAR(equation_2_distance_m(grid, 0.004, 1), 198.0 / 64.0, 0.01);
}

TEST(PixelGrid, WindowHasThePixelsThatACircleTouches) {
  const PixelGrid grid(100, 0.5);
  const PixelWindow window = window_around(grid, {10.5, 20.9}, 0.2);
  EXPECT_EQ(window.first_column, 10U);
  EXPECT_EQ(window.end_column, 11U);
  EXPECT_EQ(window.first_row, 20U);
  EXPECT_EQ(window.end_row, 22U);
  EXPECT_EQ(window.size(), 2U);
  EXPECT_TRUE(window.has(10, 21));
  EXPECT_FALSE(window.has(11, 21));
  EXPECT_EQ(window_around(grid, {99.9, 0.0}, 3.0).size(), 4U * 4U) << "cut off at the border";
  EXPECT_EQ(window_around(grid, {-50.0, 0.0}, 3.0).size(), 0U);
}

/// All items of a study, in order.
template <typename Visit>
void each_item(StudyWork& work, const Visit& visit) {
  std::size_t items = 0;
  for (; !work.is_over(); work.next_item()) {
    EXPECT_EQ(work.items_done(), items++);
    visit(work);
  }
  EXPECT_EQ(items, work.items());
}

TEST(StudyWork, EachPixelIsTracedOnceWithAllItsSamples) {
  const StudyOptions options = options_with({{.samples_per_axis = 1}, {.beam_rad = 0.0524 * degree}});
  StudyWork work(options, grid_of(options), scene, 1);
  std::vector<int> traced(1080 * 1080);
  each_item(work, [&](const StudyWork& item) {
    if (item.purpose() == StudyPurpose::detection) return;
    const std::uint64_t once = item.elements() / item.repetitions();
    for (std::uint64_t i = 0; i < item.elements(); ++i) {
      ASSERT_EQ(item.is_repeated(i), i >= once);
      if (i < once)
        ++traced[item.element(i).pixel];
      else
        ASSERT_EQ(item.element(i).direction_world, item.element(i % once).direction_world);
    }
    if (item.purpose() == StudyPurpose::port) {
      EXPECT_GE(item.elements(), min_port_elements);
      EXPECT_EQ(item.repetitions() > 1, item.distance() == 1) << "few pixels see the port from 200 m";
    }
    if (item.purpose() == StudyPurpose::beside_port) {
      EXPECT_EQ(std::set<int>(traced.begin(), traced.end()), std::set<int>{1});
      std::fill(traced.begin(), traced.end(), 0);
    }
  });
}

TEST(StudyWork, SamplesAreASquareGridInTheirPixel) {
  const StudyOptions options = options_with({{.samples_per_axis = 4}});
  const PixelGrid grid = grid_of(options);
  StudyWork work(options, grid, scene, 1);
  work.next_item();
  ASSERT_EQ(work.purpose(), StudyPurpose::port);
  // The middle of the picture is the port: the sensor is 20 m in front of it and looks along -y; left is +x.
  EXPECT_LT(glm::length(work.sensor_m() - glm::dvec3(3.0, 22.0, 1.0)), 1e-12);
  std::map<std::uint32_t, std::set<std::pair<int, int>>> samples;
  for (std::uint64_t i = 0; i < work.elements(); ++i) {
    const StudyElement element = work.element(i);
    const glm::dvec3& d = element.direction_world;
    const glm::dvec2 place = grid.place({-d.y, d.x, d.z});
    const glm::dvec2 corner(element.pixel % 1080, element.pixel / 1080);
    const glm::dvec2 in_pixel = (place - corner) * 4.0 - glm::dvec2(0.5);
    EXPECT_NEAR(in_pixel.x, std::round(in_pixel.x), 1e-6);
    EXPECT_NEAR(in_pixel.y, std::round(in_pixel.y), 1e-6);
    samples[element.pixel].emplace(std::lround(in_pixel.x), std::lround(in_pixel.y));
  }
  // A circle of 1 m at 20 m has a radius of 77 pixels.
  EXPECT_NEAR(static_cast<double>(samples.size()), 156.0 * 156.0, 1000.0);
  for (const auto& [pixel, places] : samples) {
    ASSERT_EQ(places.size(), 16U);
    EXPECT_EQ(*places.begin(), std::pair(0, 0));
    EXPECT_EQ(*places.rbegin(), std::pair(3, 3));
  }
}

TEST(StudyWork, OnlyAShareOfTheOtherPixelsIsTracedWithManySamples) {
  const StudyOptions options = options_with({{.samples_per_axis = 8}});
  StudyWork work(options, grid_of(options), scene, 1);
  each_item(work, [&](const StudyWork& item) {
    if (item.purpose() != StudyPurpose::beside_port) return;
    const double beside_port = static_cast<double>(item.pixels_beside_port());
    EXPECT_NEAR(static_cast<double>(item.pixels()), 0.01 * beside_port, 0.001 * beside_port);
    EXPECT_EQ(item.elements(), item.pixels() * 64U);
  });
}

/// In each shift, the pixel that contains the reflector is among those that are traced.
TEST(StudyWork, DetectionCoversTheReflectorInEveryShift) {
  const StudyOptions options = options_with({{.samples_per_axis = 1}, {.beam_rad = 0.0524 * degree}});
  const PixelGrid grid = grid_of(options);
  for (const std::uint64_t seed : {1U, 2U, 3U, 4U, 5U}) {
    StudyWork work(options, grid, scene, seed);
    std::set<std::pair<long, long>> phases;
    each_item(work, [&](const StudyWork& item) {
      if (item.purpose() != StudyPurpose::detection) return;
      const glm::dvec3 to = glm::normalize(scene.reflector_m - item.sensor_m());
      const glm::dvec2 reflector = grid.place({-to.y, to.x, to.z});
      ASSERT_EQ(item.elements(), item.pixels_of_a_shift() * options.shifts);
      for (std::uint32_t shift = 0; shift < options.shifts; ++shift) {
        double nearest = 1e9;
        for (std::uint64_t i = 0; i < item.pixels_of_a_shift(); ++i) {
          const glm::dvec3 d = item.element(shift * item.pixels_of_a_shift() + i).direction_world;
          const glm::dvec2 middle = grid.place({-d.y, d.x, d.z});
          if (i == 0) {
            phases.emplace(std::lround(1e6 * (middle.x - std::floor(middle.x))),
                           std::lround(1e6 * (middle.y - std::floor(middle.y))));
          }
          const glm::dvec2 from = glm::abs(middle - reflector);
          nearest = std::min(nearest, std::max(from.x, from.y));
        }
        EXPECT_LE(nearest, 0.5 + 1e-6);
      }
    });
    EXPECT_EQ(phases.size(), options.shifts) << "the shifts differ";
  }
}

TEST(StudyResult, CountsWhatContradictsThePaper) {
  const StudyOptions options = options_with({{.samples_per_axis = 1},
                                             {.samples_per_axis = 64},
                                             {.beam_rad = 0.02 * degree},
                                             {.beam_rad = 0.0524 * degree}});
  StudyResult result(options, grid_of(options));
  EXPECT_FALSE(result.tiles(options.methods[2]));
  EXPECT_TRUE(result.tiles(options.methods[3]));
  for (std::size_t d = 0; d < 2; ++d) {
    for (std::size_t m = 0; m < 4; ++m)
      result.at(d, m) = {.complete = true, .detections = 10};
  }
  EXPECT_EQ(result.missed_by_tiling_beams(), 0U);
  // One ray in a pixel detects at 20 m and 200 m, beyond 2.5 * 3.1 m; 64 x 64 rays do not detect at 200 m.
  EXPECT_EQ(result.detected_by_rays_beyond(2.5), 2U);
  result.at(0, 0).detections = result.at(1, 0).detections = 8;
  EXPECT_EQ(result.detected_by_rays_beyond(2.5), 0U);
  result.at(1, 3).detections = 8;
  EXPECT_EQ(result.missed_by_tiling_beams(), 1U);
  result.at(1, 3).complete = false;
  EXPECT_EQ(result.missed_by_tiling_beams(), 0U) << "it is not over";
}

TEST(StudyResult, TimeOfAFrameIsEstimatedFromTheShare) {
  const StudyOptions options = options_with({{.samples_per_axis = 8}});
  StudyResult result(options, grid_of(options));
  result.at(0, 0) = {.complete = true,
                     .detections = 10,
                     .port = {.wall_ns = 2'000'000'000, .pixels = 200},
                     .port_pixels = 100,
                     .beside_port = {.wall_ns = 1'000'000'000, .pixels = 50},
                     .pixels_beside_port = 5000};
  EXPECT_DOUBLE_EQ(result.at(0, 0).frame_s(), 1.0 + 100.0);
  const contribution::Section section = result.section("study");
  ASSERT_EQ(section.tables.size(), 1U);
  EXPECT_EQ(section.tables[0].rows.size(), 1U) << "what is not complete is left out";
  EXPECT_EQ(section.tables[0].rows[0].size(), section.tables[0].columns.size());
  ASSERT_EQ(section.plots.size(), 2U);
  EXPECT_EQ(section.plots[0].series.at(0).points, (std::vector<std::array<double, 2>>{{20.0, 100.0}}));
}

}  // namespace
}  // namespace hil::modules
