// Sync mode: no version is readable before it is on disk, and the log discards late firm transactions too.

#include <cerrno>

#include "logged_engine.hpp"

namespace rtstdb::transaction::test {
namespace {

class Sync : public testing::Test {
 protected:
  static LoggedEngineOptions options() {
    LoggedEngineOptions options;
    options.mode = DurabilityMode::sync;
    return options;
  }
  SimulatedDisk disk_{7};
  std::mt19937_64 random_{7};
  Model model_;
};

TEST_F(Sync, NothingIsReadableBeforeItIsOnDisk) {
  LoggedEngine db(disk_, options());
  ASSERT_TRUE(db.commit(model_, random_).durable);
  const Version before = db.engine.latest().version;
  DiskGate gate(disk_, DiskCall::sync);
  const auto writer = db.submit_create(9);
  gate.wait_until_held();
  const auto reader = db.make();
  reader->begin({});
  db.engine.submit(*reader);
  EXPECT_EQ(db.engine.latest().version, before);
  EXPECT_EQ(writer->status(), Status::pending);
  gate.open();
  EXPECT_TRUE(db.engine.wait(*writer).durable);
  EXPECT_EQ(db.engine.wait(*reader).version, writer->outcome().version) << "the engine waits for the disk";
}

TEST_F(Sync, ATransactionThatTheDiskMakesLateIsDiscardedInTheLog) {
  {
    LoggedEngine db(disk_, options());
    ASSERT_TRUE(db.commit(model_, random_).durable);
    const Version before = db.engine.latest().version;
    disk_.before_each([&](DiskCall call) {
      if (call == DiskCall::sync) db.clock.advance(Nanoseconds(1'000'000));
    });
    const Outcome& outcome =
        db.commit(model_, random_, terms(DeadlineClass::firm, db.clock.peek() + Nanoseconds(500'000)));
    EXPECT_EQ(outcome.status, Status::missed);
    EXPECT_GE(outcome.lateness, Nanoseconds(500'000));
    EXPECT_FALSE(outcome.in_doubt);
    EXPECT_FALSE(outcome.durable);
    EXPECT_EQ(db.engine.latest().version, before);
    EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
    // After an immediate power loss: the reported outcome is on disk.
    disk_.before_each(nullptr);
    SimulatedDisk after(1);
    disk_.at_crash_keep(SimulatedDisk::Keeps::nothing);
    after.set_contents(disk_.contents());
    const auto recovered = log::recover(after);
    ASSERT_TRUE(recovered.ok());
    EXPECT_EQ(recovered.value().world.latest.version, before);
    // A soft transaction is late and committed.
    disk_.before_each([&](DiskCall call) {
      if (call == DiskCall::sync) db.clock.advance(Nanoseconds(1'000'000));
    });
    const Outcome& late =
        db.commit(model_, random_, terms(DeadlineClass::soft, db.clock.peek() + Nanoseconds(500'000)));
    EXPECT_EQ(late.status, Status::late);
    EXPECT_TRUE(late.durable);
    disk_.before_each(nullptr);
  }
  disk_.crash();
  LoggedEngine db(disk_, options());
  EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
  EXPECT_TRUE(db.commit(model_, random_).durable);
}

TEST_F(Sync, ATransactionThatIsLateBeforeItsRecordIsNotWritten) {
  LoggedEngine db(disk_, options());
  ASSERT_TRUE(db.commit(model_, random_).durable);
  const std::uint64_t groups = db.log().state().groups;
  SimulatedQuery query(1);
  db.executor.work = [&](const auto&, const auto&, const auto&) {
    db.clock.advance(Nanoseconds(1'000'000));
    return query::RunReport{};
  };
  const auto transaction = db.make();
  transaction->begin(terms(DeadlineClass::firm, db.clock.peek() + Nanoseconds(500'000)));
  transaction->create(body(3));
  transaction->add_query(query, 1);
  EXPECT_EQ(db.execute(*transaction).status, Status::missed);
  EXPECT_EQ(db.log().state().groups, groups);
}

/// The sync of its group fails: only recovery after a crash decides whether it is on disk.
TEST_F(Sync, ADiskFailureLeavesTheCommitInDoubt) {
  int recovered = 0, discarded = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SimulatedDisk disk(seed);
    Model model;
    std::mt19937_64 random(seed);
    Version doubted = 0;
    {
      LoggedEngine db(disk, options());
      ASSERT_TRUE(db.commit(model, random).durable);
      disk.fail_kind(DiskCall::sync, EIO);
      const Outcome& outcome = db.commit(model, random);
      EXPECT_EQ(outcome.status, Status::refused);
      EXPECT_EQ(outcome.refused_by, RefusedBy::log_fault);
      ASSERT_TRUE(outcome.in_doubt);
      EXPECT_NE(describe(outcome).find("recovery may find it committed"), std::string::npos);
      doubted = outcome.version;
      EXPECT_LT(db.engine.latest().version, doubted);
      EXPECT_EQ(describe(db.image()), describe(without_generations(model.now())));
      db.engine.close();
      disk.crash();
      disk.fail_kind(DiskCall::remove, EIO);
    }
    disk.fail_kind(DiskCall::sync, 0);
    disk.fail_kind(DiskCall::remove, 0);
    auto log = open_log(disk, log_options(options()));
    ASSERT_TRUE(log.ok()) << log.error().message;
    const Version version = log.value()->recovery().version;
    ASSERT_TRUE(version == doubted || version == doubted - 1) << version;
    (version == doubted ? recovered : discarded)++;
    model.continue_at(version);
    LoggedEngine db(std::move(log).value(), options());
    EXPECT_EQ(describe(db.image()), describe(without_generations(model.now())));
    EXPECT_TRUE(db.commit(model, random).durable);
  }
  EXPECT_GT(recovered, 0);
  EXPECT_GT(discarded, 0);
}

}  // namespace
}  // namespace rtstdb::transaction::test
