// The program of the contact benchmark in tiny mode.

#include <gtest/gtest.h>

#include "tests/support/bench_program.hpp"

namespace hil::bench {
namespace {

constexpr Expected expected_figures[] = {
    {"narrow_convex_10k", "kpair/s", "FCL"},
    {"narrow_convex_10k_device", "kpair/s", ""},
    {"narrow_convex_right", "of 200 pairs", "FCL"},
    {"contact_16_pairs_p50", "us", ""},
    {"contact_16_pairs_p99", "us", ""},
    {"broad_10k", "kbody/s", "FCL"},
    {"broad_10k_device", "kbody/s", ""},
    {"time_of_impact_1k", "kpair/s", ""},
    {"time_of_impact_surfaces_1k", "kpair/s", ""},
};

TEST(BenchContact, PrintsAFigurePerLine) {
  expect_figures(run_program(std::string(HIL_BENCH_CONTACT) + " --tiny --json"), expected_figures);
}

}  // namespace
}  // namespace hil::bench
