#include "simulation.hpp"

namespace rtstdb::log::test {
namespace {

TEST(LogSimulationAtLength, EveryCrashLeavesAStateThatWasAndNothingToldIsLost) {
  simulate(20'000);
}

}  // namespace
}  // namespace rtstdb::log::test
