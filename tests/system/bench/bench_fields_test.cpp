// The program of the fields benchmark in tiny mode.

#include <gtest/gtest.h>

#include "tests/support/bench_program.hpp"

namespace hil::bench {
namespace {

constexpr Expected expected_figures[] = {
    {"cone_fast_vs_ray", "Mcone/s", "closest-hit rays"},
    {"cone_exact_vs_ray", "Mcone/s", "closest-hit rays"},
    {"cone_fractions_vs_exact", "Mcone/s", "exact cones"},
    {"cone_fast_fractions_vs_exact", "Mcone/s", "exact cones"},
    {"cone_fast_vs_ray_scattered", "Mcone/s", "closest-hit rays"},
    {"cone_exact_vs_ray_scattered", "Mcone/s", "closest-hit rays"},
    {"cone_fractions_vs_exact_scattered", "Mcone/s", "exact cones"},
    {"cone_fast_fractions_vs_exact_scattered", "Mcone/s", "exact cones"},
    {"field_build_sphere", "kdistance/s", "signed nearest query"},
    {"field_build_sphere_seconds", "s", ""},
    {"field_build_sphere_bytes", "B", ""},
    {"field_build_sphere_error_p99", "ppm", ""},
    {"field_build_box", "kdistance/s", "signed nearest query"},
    {"field_build_box_seconds", "s", ""},
    {"field_build_box_bytes", "B", ""},
    {"field_build_box_error_p99", "ppm", ""},
    {"field_error_sphere_8", "ppm", "order 0"},
    {"field_error_sphere_8_planes", "ppm", "blended planes"},
    {"field_error_sphere_16", "ppm", "order 0"},
    {"field_error_sphere_16_planes", "ppm", "blended planes"},
    {"field_error_box_8", "ppm", "order 0"},
    {"field_error_box_8_planes", "ppm", "blended planes"},
    {"field_error_box_16", "ppm", "order 0"},
    {"field_error_box_16_planes", "ppm", "blended planes"},
};

TEST(BenchFields, PrintsAFigurePerLine) {
  expect_figures(run_program(std::string(HIL_BENCH_FIELDS) + " --tiny --json"), expected_figures);
}

TEST(BenchFields, MeasuresOneFamily) {
  const Output output = run_program(std::string(HIL_BENCH_FIELDS) + " --tiny --json field_builds");
  EXPECT_EQ(output.exit_code, 0) << output.text;
  EXPECT_EQ(output.lines.size(), 8u) << output.text;
}

}  // namespace
}  // namespace hil::bench
