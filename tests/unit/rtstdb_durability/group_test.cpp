// Group mode: commits that arrive while the disk is busy share the next group; the engine does not wait.

#include <thread>

#include "logged_engine.hpp"

namespace rtstdb::transaction::test {
namespace {

LoggedEngineOptions group_mode() {
  LoggedEngineOptions options;
  options.mode = DurabilityMode::group;
  options.checkpoint_every_bytes = 0;
  return options;
}

TEST(Group, CommitsOfSeveralClientsShareOneWrite) {
  SimulatedDisk disk(1);
  LoggedEngine db(disk, group_mode());
  DiskGate gate(disk, DiskCall::sync);
  const auto first = db.submit_create(1);
  gate.wait_until_held();
  const std::uint64_t groups = db.log().state().groups;
  constexpr std::uint32_t clients = 8;
  std::vector<std::thread> threads;
  std::vector<Outcome> outcomes(clients);
  for (std::uint32_t k = 0; k < clients; ++k)
    threads.emplace_back([&, k] { outcomes[k] = db.engine.wait(*db.submit_create(2 + k)); });
  // All are published while the disk is busy.
  while (db.engine.latest().version < 1 + clients)
    std::this_thread::yield();
  EXPECT_EQ(first->status(), Status::pending);
  EXPECT_EQ(db.log().durable(), 0u);
  gate.open();
  for (std::thread& thread : threads)
    thread.join();
  EXPECT_TRUE(db.engine.wait(*first).durable);
  for (const Outcome& outcome : outcomes) {
    EXPECT_EQ(outcome.status, Status::committed);
    EXPECT_TRUE(outcome.durable);
  }
  EXPECT_EQ(db.log().state().groups, groups + 2);
  EXPECT_EQ(db.engine.counts().committed, 1 + clients);
}

TEST(Group, CancellingAHeldTransactionHasNoEffect) {
  SimulatedDisk disk(1);
  LoggedEngine db(disk, group_mode());
  DiskGate gate(disk, DiskCall::sync);
  const auto transaction = db.submit_create(1);
  gate.wait_until_held();
  db.engine.cancel(*transaction);
  gate.open();
  EXPECT_EQ(db.engine.wait(*transaction).status, Status::committed);
  EXPECT_TRUE(transaction->outcome().durable);
  EXPECT_EQ(db.image()[0].mask, 1u);
}

/// A deadline applies to publication: the time of the disk does not count.
TEST(Group, DiskTimeDoesNotCountForTheDeadline) {
  SimulatedDisk disk(1);
  LoggedEngine db(disk, group_mode());
  disk.before_each([&](DiskCall call) {
    if (call == DiskCall::sync) db.clock.advance(Nanoseconds(5'000'000));
  });
  const auto transaction = db.make();
  const ClockTime deadline = db.clock.peek() + Nanoseconds(1'000'000);
  transaction->begin(terms(DeadlineClass::firm, deadline));
  transaction->create(body(1));
  const Outcome& outcome = db.execute(*transaction);
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_LE(outcome.published, deadline);
  EXPECT_GT(outcome.durable_at, deadline);
  EXPECT_EQ(db.engine.counts().firm_late_commits, 0u);
  EXPECT_EQ(db.engine.counts().firm_delivered_late, 0u);
  db.engine.close();
  disk.before_each(nullptr);
}

TEST(Group, HeldTransactionHasItsAnswersAndUsesItsReservation) {
  SimulatedDisk disk(1);
  LoggedEngine db(disk, group_mode());
  SimulatedQuery query(8);
  auto reserved = db.engine.reserve({.name = "r",
                                     .period = Nanoseconds(100'000'000),
                                     .deadline = Nanoseconds(100'000'000),
                                     .budget = Nanoseconds(10'000'000),
                                     .writes_and_queries = true});
  ASSERT_TRUE(reserved.ok()) << reserved.error().message;
  auto reservation = std::move(reserved).value();
  const auto transaction = db.make();
  for (std::uint32_t k = 0; k < 3; ++k) {
    Terms given = terms(DeadlineClass::hard, ClockTime::max());
    given.reservation = reservation.get();
    transaction->begin(given);
    transaction->create(body(1 + k));
    transaction->add_query(query, 5 + k);
    const Outcome& outcome = db.execute(*transaction);
    ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
    EXPECT_TRUE(outcome.durable);
    EXPECT_EQ(query.answer_info().elements, 5 + k);
    EXPECT_EQ(query.answer_info().version, outcome.version);
    EXPECT_EQ(reservation->counts().transactions, k + 1);
    EXPECT_EQ(reservation->counts().kept, k + 1);
    db.clock.advance(Nanoseconds(100'000'000));
  }
  reservation.reset();
}

}  // namespace
}  // namespace rtstdb::transaction::test
