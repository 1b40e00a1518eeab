#include "simulation.hpp"

#include "tests/support/rounds.hpp"

namespace rtstdb::log::test {
namespace {

TEST(LogSimulation, EveryCrashLeavesAnEarlierStateAndLosesNoDurableVersion) {
  simulate(hil::tests::rounds(150, 20'000));
}

}  // namespace
}  // namespace rtstdb::log::test
