#pragma once
// The device of a database is lost at calls that are counted, beside a database that is left alone. Which
// calls: every one in the long form, a sample in the short one.

#include <algorithm>
#include <chrono>
#include <functional>
#include <string>

#include "tests/gpu/loss_world.hpp"

namespace rtstdb::test {

class DeviceLossTest : public testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  /// One round of a kind in both; lost ones are asked again until they are done.
  void expect_same(std::size_t kind, unsigned round);
  void expect_same_rows();
  /// The round is lost at that call and leaves nothing, then it is done and answers the same. False: it has
  /// fewer calls.
  bool lose_at(std::uint64_t call, std::size_t kind, unsigned round);

  // `every`: every so manieth call is looked at, and the first few.
  void lose_at_calls_of_each_kind(std::uint64_t every);
  void lose_at_calls_while_it_comes_back(std::uint64_t every);
  void lose_at_calls_while_geometry_is_added(std::uint64_t every);
  void lose_at_calls_while_queries_are_prepared(std::uint64_t every);

  gpu::test::FaultLoader loader_;
  unsigned round_ = 0;
  LossWorld lost_{LossWorld::On::failing_device, {.validation = Validation::on}};
  LossWorld whole_{LossWorld::On::real_device};
};

/// While no other database has the failing loader.
void lose_at_calls_while_a_database_opens(std::uint64_t every);

}  // namespace rtstdb::test
