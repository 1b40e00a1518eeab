// Else no seed would find again what it found.

#include <gtest/gtest.h>

#include "tests/long/engine_simulation.hpp"

namespace hil::stress {
namespace {

TEST(EngineSimulation, TheSameSeedIsTheSameCourse) {
  for (const std::uint64_t seed : {7u, 8u, 9u, 10u, 11u, 12u}) {
    SimulationCounts counts[2];
    for (SimulationCounts& one : counts) {
      EngineSimulation simulation(seed);
      ASSERT_EQ(simulation.run(10'000), "");
      one = simulation.counts();
    }
    EXPECT_TRUE(counts[0] == counts[1]) << "HIL_SIM_SEED=" << seed;
  }
}

}  // namespace
}  // namespace hil::stress
