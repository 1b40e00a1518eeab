// The tick's calls neither allocate nor free memory, on the caller's thread and on the engine thread.

#include <gtest/gtest.h>

#include "tests/support/allocation_guard.hpp"
#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

TEST(Allocation, DoesNotOccurInTicks) {
  World world(engine_options(8, 64, 128));
  std::vector<std::uint32_t> changed;
  changed.reserve(64);
  Version device_version = 0;
  int runs = 0;
  world.executor.work = [&](const store::RowSource& rows, const auto&, const auto&) {
    changed.clear();
    static_cast<void>(rows.changed_between(device_version, changed));
    device_version = rows.version();
    // Some transactions are done, some are missed, some are truncated.
    if (++runs % 5 == 0) world.clock.advance(2ms);
    return query::RunReport{runs % 7 == 0 ? query::RunStatus::truncated : query::RunStatus::done, 0};
  };
  SimulatedQuery query(16);
  const auto transaction = world.make(8, 2);
  const auto tight = world.make(1, 1);
  const auto tick = [&](int k) {
    const ClockTime deadline = world.clock.peek() + 1ms;
    Terms given = terms(k % 2 == 0 ? DeadlineClass::firm : DeadlineClass::soft, deadline,
                        static_cast<std::uint8_t>(k % 8));
    transaction->begin(given);
    transaction->expect_exists({0, 1});
    const std::uint32_t ordinal = transaction->create(row_of(static_cast<std::uint32_t>(k)));
    transaction->update({0, 1}, row_of(3));
    transaction->update_motion({0, 1}, Motion{});
    transaction->add_query(query, 4);
    world.execute(*transaction);
    const EntityId created = transaction->created(ordinal);
    transaction->begin({});
    if (created.valid()) transaction->remove(created);
    if (k % 3 == 0) transaction->remove({60, 9});  // refused
    world.execute(*transaction);
    if (created.valid() && !transaction->outcome().done()) {
      transaction->begin({});
      transaction->remove(created);
      world.execute(*transaction);
    }
    tight->begin(terms(DeadlineClass::firm, world.clock.peek() + 1ns));
    tight->add_query(query, 1);
    world.engine.submit(*tight);
    world.engine.wait(*tight);
    static_cast<void>(world.engine.latest());
    static_cast<void>(world.engine.counts());
  };
  world.create(1);
  tick(0);
  const TransactionCounts before = world.engine.counts();
  hil::allocation_guard::reset();
  world.engine.call([] { hil::allocation_guard::enter_tick(); });
  hil::allocation_guard::enter_tick();
  for (int k = 1; k < 3000; ++k)
    tick(k);
  hil::allocation_guard::leave_tick();
  world.engine.call([] { hil::allocation_guard::leave_tick(); });
  EXPECT_EQ(hil::allocation_guard::seen().total(), 0u);
  const TransactionCounts after = world.engine.counts();
  EXPECT_GT(after.committed, before.committed);
  EXPECT_GT(after.missed, before.missed) << "no version was discarded";
  EXPECT_GT(after.refused, before.refused);
  EXPECT_GT(after.truncated, before.truncated);
  EXPECT_GT(after.bad_input, before.bad_input);
}

}  // namespace
}  // namespace rtstdb::transaction::test
