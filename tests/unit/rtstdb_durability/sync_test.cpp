// Sync mode: no version is readable before it is on disk, and late firm transactions are discarded in the log
// too.

#include <cerrno>
#include <thread>

#include "life.hpp"

namespace rtstdb::transaction::test {
namespace {

class Sync : public testing::Test {
 protected:
  static LifeOptions options() {
    LifeOptions options;
    options.mode = DurabilityMode::sync;
    return options;
  }
  SimulatedDisk disk_{7};
  std::mt19937_64 random_{7};
  Model model_;
};

TEST_F(Sync, NothingIsReadableBeforeItIsOnDisk) {
  Life life(disk_, options());
  ASSERT_TRUE(life.commit(model_, random_).durable);
  const Version before = life.engine.latest().version;
  DiskGate gate(disk_, DiskCall::sync);
  gate.close();
  const auto writer = life.make();
  writer->begin({});
  writer->create(body(9));
  life.engine.submit(*writer);
  gate.wait_until_somebody_stands_there();
  const auto reader = life.make();
  reader->begin({});
  life.engine.submit(*reader);
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(life.engine.latest().version, before);
  EXPECT_EQ(writer->status(), Status::pending);
  EXPECT_EQ(reader->status(), Status::pending) << "the engine waits for the disk";
  gate.open();
  EXPECT_TRUE(life.engine.wait(*writer).durable);
  EXPECT_EQ(life.engine.wait(*reader).version, writer->outcome().version);
}

TEST_F(Sync, TransactionMadeLateByTheDiskIsDiscardedInTheLog) {
  {
    Life life(disk_, options());
    ASSERT_TRUE(life.commit(model_, random_).durable);
    const Version before = life.engine.latest().version;
    disk_.before_each([&](DiskCall call) {
      if (call == DiskCall::sync) life.clock.advance(Nanoseconds(1'000'000));
    });
    const Outcome& outcome =
        life.commit(model_, random_, terms(DeadlineClass::firm, life.clock.peek() + Nanoseconds(500'000)));
    EXPECT_EQ(outcome.status, Status::missed);
    EXPECT_GE(outcome.lateness, Nanoseconds(500'000));
    EXPECT_FALSE(outcome.in_doubt);
    EXPECT_FALSE(outcome.durable);
    EXPECT_EQ(life.engine.latest().version, before);
    EXPECT_EQ(describe(life.image()), describe(living(model_.now())));
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
      if (call == DiskCall::sync) life.clock.advance(Nanoseconds(1'000'000));
    });
    const Outcome& late =
        life.commit(model_, random_, terms(DeadlineClass::soft, life.clock.peek() + Nanoseconds(500'000)));
    EXPECT_EQ(late.status, Status::late);
    EXPECT_TRUE(late.durable);
    disk_.before_each(nullptr);
  }
  disk_.crash();
  Life life(disk_, options());
  EXPECT_EQ(describe(life.image()), describe(living(model_.now())));
  EXPECT_TRUE(life.commit(model_, random_).durable);
}

TEST_F(Sync, TransactionLateBeforeTheDiskIsNotWritten) {
  Life life(disk_, options());
  ASSERT_TRUE(life.commit(model_, random_).durable);
  const std::uint64_t groups = life.log().state().groups;
  SimulatedQuery query(1);
  life.executor.work = [&](const auto&, const auto&, const auto&) {
    life.clock.advance(Nanoseconds(1'000'000));
    return query::RunReport{};
  };
  const auto transaction = life.make();
  transaction->begin(terms(DeadlineClass::firm, life.clock.peek() + Nanoseconds(500'000)));
  transaction->create(body(3));
  transaction->add_query(query, 1);
  EXPECT_EQ(life.execute(*transaction).status, Status::missed);
  EXPECT_EQ(life.log().state().groups, groups);
}

/// The sync of its group fails, so whether it is on disk is unknown until a crash.
TEST_F(Sync, DiskFailureIsReportedAsInDoubt) {
  int stood = 0, fell = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    SimulatedDisk disk(seed);
    Model model;
    std::mt19937_64 random(seed);
    Version doubted = 0;
    {
      Life life(disk, options());
      ASSERT_TRUE(life.commit(model, random).durable);
      disk.fail_kind(DiskCall::sync, EIO);
      const Outcome& outcome = life.commit(model, random);
      EXPECT_EQ(outcome.status, Status::refused);
      EXPECT_EQ(outcome.refused_by, RefusedBy::log_fault);
      ASSERT_TRUE(outcome.in_doubt);
      EXPECT_NE(describe(outcome).find("recovery may find it committed"), std::string::npos);
      doubted = outcome.version;
      EXPECT_LT(life.engine.latest().version, doubted);
      EXPECT_EQ(describe(life.image()), describe(living(model.now())));
      life.engine.close();
      disk.crash();
      disk.fail_kind(DiskCall::remove, EIO);
    }
    disk.fail_kind(DiskCall::sync, 0);
    disk.fail_kind(DiskCall::remove, 0);
    auto log = open_log(disk, log_options(options()));
    ASSERT_TRUE(log.ok()) << log.error().message;
    const Version version = log.value()->recovery().version;
    ASSERT_TRUE(version == doubted || version == doubted - 1) << version;
    (version == doubted ? stood : fell)++;
    model.go_on_at(version);
    Life life(std::move(log).value(), options());
    EXPECT_EQ(describe(life.image()), describe(living(model.now())));
    EXPECT_TRUE(life.commit(model, random).durable);
  }
  EXPECT_GT(stood, 0);
  EXPECT_GT(fell, 0);
}

}  // namespace
}  // namespace rtstdb::transaction::test
