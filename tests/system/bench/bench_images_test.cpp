// The program of the images benchmark in tiny mode.

#include <gtest/gtest.h>

#include "tests/support/bench_program.hpp"

namespace hil::bench {
namespace {

constexpr Expected expected_figures[] = {
    {"raster_over_ray_first_hits", "ms", "the same image, traced"},
    {"path_tracer_rays", "Mray/s", "like rays as queries"},
    {"image_crossing_640x480", "ms", "path tracer, 16 samples"},
    {"image_crossing_640x480_bounce", "ms", "path tracer, 16 samples"},
    {"shadow_maps", "ms", "the same image, traced shadows"},
};

TEST(BenchImages, PrintsAFigurePerLine) {
  expect_figures(run_program(std::string(HIL_BENCH_IMAGES) + " --tiny --json"), expected_figures);
}

}  // namespace
}  // namespace hil::bench
