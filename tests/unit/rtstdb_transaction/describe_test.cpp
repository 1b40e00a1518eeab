#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

TEST(Describe, HoldsTheValuesOfAnOutcome) {
  Outcome outcome;
  outcome.status = Status::committed;
  outcome.version = 12;
  outcome.version_time = world_time_ns(1'250'000'000);
  outcome.actual_cost = Nanoseconds(340'000);
  outcome.predicted_cost = Nanoseconds(300'000);
  EXPECT_EQ(describe(outcome),
            "committed: version 12, which holds from 1.250000000 s, took 0.340 ms, predicted 0.300 ms");

  outcome.status = Status::late;
  outcome.lateness = Nanoseconds(1'500'000);
  outcome.truncated = true;
  EXPECT_EQ(
      describe(outcome),
      "late by 1.500 ms: version 12, which holds from 1.250000000 s, took 0.340 ms, predicted 0.300 ms; at "
      "least one answer is incomplete or has overflowed");

  Outcome refused;
  refused.status = Status::refused;
  refused.predicted_cost = Nanoseconds(2'000'000);
  refused.submitted = clock_time_ns(10'000'000);
  refused.earliest_feasible = clock_time_ns(13'000'000);
  EXPECT_EQ(
      describe(refused),
      "refused: predicted to take 2.000 ms; the earliest deadline that could be met lies 3.000 ms after it "
      "was submitted; nothing was done");

  Outcome conflict;
  conflict.status = Status::conflict;
  conflict.version = 8;
  conflict.conflict = {1, {4, 2}, true, 7};
  EXPECT_EQ(
      describe(conflict),
      "conflict: precondition 1 does not hold in version 8: entity 4 (generation 2) was last written by "
      "version 7; nothing was done");
}

TEST(Describe, NamesPlaceAndValueOfBadInput) {
  World world;
  const auto transaction = world.make();
  transaction->begin({});
  transaction->create(row_of(1));
  transaction->remove({5, 3});
  EXPECT_EQ(describe(world.execute(*transaction)),
            "bad_input: entity 5 (generation 3) does not exist, in write 1; nothing was done");

  const auto expect_refusal = [&](const std::string& problem, const std::function<void(EntityRow&)>& spoil) {
    EntityRow row = row_of(1);
    spoil(row);
    transaction->begin({});
    transaction->create(row);
    EXPECT_EQ(describe(world.execute(*transaction)),
              "bad_input: " + problem + ", in write 0; nothing was done");
  };
  expect_refusal("scale.x is -1; it must be 1e-06 to 100000", [](EntityRow& row) { row.scale.x = -1.0; });
  expect_refusal("scale.z is 200000; it must be 1e-06 to 100000", [](EntityRow& row) { row.scale.z = 2e5; });
  expect_refusal("motion.p_world_m.y is -300000; it must be -100000 to 100000",
                 [](EntityRow& row) { row.motion.p_world_m.y = -3e5; });
  expect_refusal("motion.q_world.z is inf; it must be finite",
                 [](EntityRow& row) { row.motion.q_world.z = HUGE_VAL; });
  expect_refusal("the length of motion.v_world_mps is 500000; it must be 0 to 100000", [](EntityRow& row) {
    row.motion.v_world_mps = {3e5, 0.0, -4e5};
  });

  Terms too_far;
  too_far.world_time = world_time_ns(max_world_time_ns + 1);
  transaction->begin(too_far);
  transaction->create(row_of(1));
  const std::string refused = describe(world.execute(*transaction));
  EXPECT_NE(refused.find(", in its terms; nothing was done"), std::string::npos) << refused;

  for (const Version version : {Version{40}, ~Version{0}}) {
    Terms pinned;
    pinned.read_at = ReadAt::pinned(version);
    transaction->begin(pinned);
    EXPECT_EQ(describe(world.execute(*transaction)),
              "bad_input: version " + std::to_string(version) +
                  " belongs to no version that was published; nothing was done");
  }
  Outcome beyond;
  beyond.status = Status::bad_input;
  beyond.bad_input.reason = BadInputReason::beyond_history;
  beyond.bad_input.values[0] = 3.0;
  beyond.bad_input.values[1] = 2.0;
  EXPECT_EQ(describe(beyond),
            "bad_input: the world at 3.000000000 s is not known: this history ends before 2.000000000 s; "
            "nothing was done");
  BadInput too_old;
  too_old.reason = BadInputReason::snapshot_too_old;
  too_old.values[0] = -1.0;
  too_old.values[1] = 3.0;
  too_old.values[2] = 0.5;
  too_old.values[3] = 2.0;
  EXPECT_EQ(
      describe(too_old),
      "snapshot_too_old: world time 0.500000000 s is no longer kept: the oldest kept version is 3, from "
      "2.000000000 s on");
}

TEST(Describe, NamesAreUnique) {
  std::set<std::string> names;
  for (int k = 0; k <= static_cast<int>(Status::bad_input); ++k)
    names.insert(to_string(static_cast<Status>(k)));
  EXPECT_EQ(names.size(), static_cast<std::size_t>(Status::bad_input) + 1);
  EXPECT_EQ(names.count("unknown"), 0u);
  names.clear();
  for (int k = 0; k <= static_cast<int>(BadInputReason::too_many_positions); ++k) {
    BadInput fault;
    fault.reason = static_cast<BadInputReason>(k);
    names.insert(to_string(fault.reason));
    EXPECT_EQ(describe(fault).rfind(to_string(fault.reason), 0), 0u);
  }
  EXPECT_EQ(names.size(), static_cast<std::size_t>(BadInputReason::too_many_positions) + 1);
  EXPECT_EQ(names.count("unknown"), 0u);
  EXPECT_STREQ(to_string(DeadlineClass::firm), "firm");
  EXPECT_STREQ(to_string(DeadlineClass::best_effort), "best_effort");
}

}  // namespace
}  // namespace rtstdb::transaction::test
