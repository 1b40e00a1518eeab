#pragma once
// Fixture of tests that lose the device of a database at the n-th Vulkan call and compare with an undisturbed
// database. The long form tests each call where a test
// does not state another stride, the short one a sample.

#include <algorithm>
#include <chrono>
#include <functional>
#include <string>

#include "tests/gpu/device_loss_world.hpp"

namespace rtstdb::test {

class DeviceLossTest : public testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  /// Executes a round in both databases, with retries after a device loss, and compares the answers.
  void expect_same(std::size_t kind, unsigned round);
  void expect_same_rows();
  /// Loses the device at that call of the round, expects no effect, and executes it again. False: the round
  /// has fewer calls.
  bool lose_at(std::uint64_t call, std::size_t kind, unsigned round);

  // `every`: tests call 1 and the multiples of `every`.
  void lose_at_calls_of_each_kind(std::uint64_t every);
  void lose_at_calls_of_recovery(std::uint64_t every);
  void lose_at_calls_while_geometry_is_added(std::uint64_t every);
  void lose_at_calls_while_queries_are_prepared(std::uint64_t every);

  gpu::test::FaultLoader loader_;
  unsigned round_ = 0;
  DeviceLossWorld lost_{DeviceLossWorld::On::failing_device, {.validation = Validation::on}};
  DeviceLossWorld undisturbed_{DeviceLossWorld::On::real_device};
};

/// While no other database uses the fault loader.
void lose_at_calls_while_a_database_opens(std::uint64_t every);

}  // namespace rtstdb::test
