#include "simulation.hpp"

namespace rtstdb::log::test {
namespace {

TEST(LogSimulation, EveryCrashLeavesAnEarlierStateAndLosesNoDurableVersion) {
  simulate(150);
}

}  // namespace
}  // namespace rtstdb::log::test
