#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <utility>
#include <vector>

#include "io/virtual/faults.hpp"

namespace hil::io::virtual_bus {
namespace {

/// The outcome and the payload of each of 1000 frames, and the counts.
std::pair<std::vector<std::uint32_t>, can::InjectedFaults> faults_of(const FaultConfig& config) {
  FaultInjector injector(config);
  std::vector<std::uint32_t> outcomes;
  for (std::uint32_t number = 0; number < 1000; ++number) {
    std::array<std::uint8_t, 4> bytes{};
    std::memcpy(bytes.data(), &number, sizeof number);
    can::Frame frame = can::make_frame(1, bytes);
    outcomes.push_back(static_cast<std::uint32_t>(injector.decide(frame, number % 2 == 0)));
    std::uint32_t payload = 0;
    std::memcpy(&payload, frame.raw.data, sizeof payload);
    outcomes.push_back(payload);
  }
  return {outcomes, injector.counters()};
}

TEST(FaultInjector, SameSeedMakesTheSameFaults) {
  FaultConfig config{.drop_probability = 0.2,
                     .corrupt_probability = 0.2,
                     .delay_probability = 0.2,
                     .delay_ns = 2'000'000,
                     .seed = 42};
  const auto [outcomes, counts] = faults_of(config);
  EXPECT_EQ(faults_of(config).first, outcomes);
  EXPECT_NEAR(static_cast<double>(counts.dropped_tx), 100.0, 30.0);
  EXPECT_NEAR(static_cast<double>(counts.dropped_rx), 100.0, 30.0);
  EXPECT_GT(counts.corrupted, 100U);
  config.seed = 43;
  EXPECT_NE(faults_of(config).first, outcomes) << "another seed makes other faults";
}

}  // namespace
}  // namespace hil::io::virtual_bus
