// The crossing with seeded changes of its scenario, its DBC file or its register map: `hil check` accepts it
// or refuses it with places.

#include <gtest/gtest.h>

#include <cstdint>

#include "tests/paths.h"
#include "tests/support/rounds.hpp"
#include "tests/support/text_mutator.hpp"
#include "tests/system/scenario/hil.hpp"

namespace hil::scenario_test {
namespace {

const std::uint64_t mutants_per_file = tests::rounds(40, 700);

void check_mutants(const std::string& name) {
  const ScenarioCopy copy;
  const std::string good = read_text(copy.folder() / name);
  int accepted = 0;
  int refused = 0;
  for (std::uint64_t seed = 1; seed <= mutants_per_file; ++seed) {
    write_text(copy.folder() / name, tests::TextMutator(seed).mutate(good));
    const Ended ended = run_hil({"check", copy.file()});
    ASSERT_TRUE(ended.code == 0 || ended.code == 2) << "seed " << seed << ", code " << ended.code << "\n"
                                                    << ended.output << ended.errors;
    ++(ended.code == 0 ? accepted : refused);
    if (ended.code == 2) {
      ASSERT_NE(ended.errors.find(copy.folder().path().string()), std::string::npos)
          << "seed " << seed << ": a refusal without its place\n"
          << ended.errors;
    }
  }
  EXPECT_GT(accepted, 0) << "both results occur";
  EXPECT_GT(refused, 0);
}

TEST(Mutants, OfTheScenarioAreAcceptedOrRefused) {
  check_mutants("crossing.yaml");
}

TEST(Mutants, OfTheDbcFileAreAcceptedOrRefused) {
  check_mutants("crossing.dbc");
}

TEST(Mutants, OfTheRegisterMapAreAcceptedOrRefused) {
  check_mutants("crossing_plc.yaml");
}

}  // namespace
}  // namespace hil::scenario_test
