// With a log, the calls of the tick neither allocate nor free memory, on the caller's thread and on the
// engine thread.

#include <chrono>

#include "logged_engine.hpp"
#include "tests/support/allocation_guard.hpp"

namespace rtstdb::transaction::test {
namespace {

class AllocationWithLog : public testing::TestWithParam<DurabilityMode> {};

INSTANTIATE_TEST_SUITE_P(Durability, AllocationWithLog, every_mode(), mode_name);

TEST_P(AllocationWithLog, DoesNotOccurInTicks) {
  LoggedEngineOptions options;
  options.mode = GetParam();
  options.ring_bytes = 4096;  // async fills it, so gaps occur
  options.checkpoint_every_bytes = 20'000;
  SimulatedDisk disk(1);
  LoggedEngine db(disk, options);
  const auto transaction = db.make();
  transaction->begin({});
  const std::uint32_t created = transaction->create(body(1));
  ASSERT_TRUE(db.execute(*transaction).done());
  const EntityId id = transaction->created(created);
  hil::allocation_guard::reset();
  db.engine.call([] { hil::allocation_guard::enter_tick(); });
  hil::allocation_guard::enter_tick();
  std::uint32_t done = 0;
  const auto begun = std::chrono::steady_clock::now();
  const auto waits_for_checkpoint = [&] {
    hil::allocation_guard::leave_tick();
    const bool written = db.log().state().checkpoints > 0;
    hil::allocation_guard::enter_tick();
    return !written && std::chrono::steady_clock::now() - begun < event_limit;
  };
  for (std::uint32_t k = 0; k < 2000 / one_in || k % 100 != 0 || waits_for_checkpoint(); ++k) {
    transaction->begin(terms(DeadlineClass::firm, db.clock.peek() + Nanoseconds(1'000'000)));
    // Alternates between a commit that async collects and one that it does not.
    for (std::uint32_t write = 0; write < (k % 2 == 0 ? 4u : 1u); ++write)
      transaction->update(id, body(k));
    const Outcome& outcome = db.execute(*transaction);
    if (outcome.done()) ++done;
    static_cast<void>(db.log().durable());
  }
  hil::allocation_guard::leave_tick();
  db.engine.call([] { hil::allocation_guard::leave_tick(); });
  EXPECT_EQ(hil::allocation_guard::seen().total(), 0u);
  EXPECT_GT(done, 100u);
  EXPECT_GT(db.log().state().groups, 0u);
  EXPECT_GE(db.log().state().checkpoints, 1u);
}

}  // namespace
}  // namespace rtstdb::transaction::test
