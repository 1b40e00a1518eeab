#include "simulation.hpp"

namespace rtstdb::log::test {
namespace {

TEST(LogSimulationAtLength, EveryCrashLeavesAnEarlierStateAndLosesNoDurableVersion) {
  simulate(20'000);
}

}  // namespace
}  // namespace rtstdb::log::test
