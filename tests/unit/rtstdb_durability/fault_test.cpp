// A disk that fails for a time or is full: no transaction waits forever, only durable ones are reported as
// durable, and after the failure the log is complete. each_call_test.cpp fails single operations.

#include <cerrno>

#include "logged_engine.hpp"
#include "tests/support/eventually.hpp"

namespace rtstdb::transaction::test {
namespace {

class Fault : public testing::TestWithParam<DurabilityMode> {
 protected:
  LoggedEngineOptions options() const { return small_options(GetParam()); }
  /// Commits until one is completed and, except in async mode, durable.
  void commit_until_repaired(LoggedEngine& db) {
    EXPECT_TRUE(hil::tests::eventually(
        [&] {
          const Outcome& outcome = db.commit(model_, random_);
          return outcome.done() && (outcome.durable || GetParam() == DurabilityMode::async);
        },
        event_limit))
        << db.log().state().last_fault;
  }
  void expect_complete() {
    LoggedEngine db(disk_, options());
    EXPECT_EQ(db.engine.latest().version, model_.newest_up_to(db.engine.latest().version))
        << db.log().recovery().summary;
    EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())))
        << db.log().recovery().summary;
  }

  SimulatedDisk disk_{3};
  std::mt19937_64 random_{3};
  Model model_;
};

INSTANTIATE_TEST_SUITE_P(Durability, Fault, every_mode(), mode_name);

/// Commits do not wait for the next attempt at a checkpoint, which counts as a fault.
TEST_P(Fault, OfCheckpointsDelaysNoCommit) {
  LoggedEngineOptions one_segment = options();
  one_segment.segment_bytes = 1 << 20;
  LoggedEngine db(disk_, one_segment);
  ASSERT_TRUE(db.commit(model_, random_).done());
  ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
  int created = 0;
  disk_.before_each([&](DiskCall call) {  // after the segment that replaces the failed one
    if (call == DiskCall::create && ++created == 2) disk_.fail_kind(DiskCall::create, EIO);
  });
  disk_.fail_call(disk_.calls() + 1, EIO);
  db.commit(model_, random_);
  ASSERT_TRUE(hil::tests::eventually([&] { return db.log().state().faults >= 8; }, event_limit))
      << db.log().state().last_fault;
  int before_an_attempt = 0;
  for (int k = 0; k < 4 && GetParam() == DurabilityMode::async; ++k) {
    const Durability before = db.log().state();
    ASSERT_TRUE(db.commit(model_, random_).done());
    ASSERT_TRUE(hil::tests::eventually([&] { return db.log().state().groups > before.groups; }, event_limit));
    before_an_attempt += db.log().state().faults == before.faults;
  }
  EXPECT_TRUE(before_an_attempt > 0 || GetParam() != DurabilityMode::async);
  disk_.before_each({});
  disk_.fail_kind(DiskCall::create, 0);
  commit_until_repaired(db);
}

TEST_P(Fault, OfAllWritesIsReportedAndRepaired) {
  auto db = std::make_unique<LoggedEngine>(disk_, options());
  ASSERT_TRUE(db->commit(model_, random_).done());
  ASSERT_TRUE(db->log().wait_until_durable(db->engine.latest().version, event_limit));
  const Version safe = db->log().durable();
  disk_.fail_kind(DiskCall::write, EIO);
  bool refused = false;
  for (int k = 0; k < 100; ++k) {
    const Outcome& outcome = db->commit(model_, random_);
    EXPECT_FALSE(outcome.durable);
    ASSERT_TRUE(outcome.done() || GetParam() != DurabilityMode::async) << describe(outcome);
    if (outcome.status == Status::refused) {
      refused = true;
      EXPECT_EQ(outcome.refused_by, RefusedBy::log_fault);
      EXPECT_NE(describe(outcome).find("disk refuses"), std::string::npos);
    }
  }
  EXPECT_EQ(refused, GetParam() != DurabilityMode::async);
  EXPECT_FALSE(db->log().wait_until_durable(safe + 1, Nanoseconds(20'000'000)));
  const Durability state = db->log().state();
  EXPECT_TRUE(state.last_write_failed);
  EXPECT_GT(state.faults, 0u);
  EXPECT_NE(state.last_fault.find("write of segment."), std::string::npos) << state.last_fault;
  EXPECT_EQ(state.durable, safe);
  disk_.fail_kind(DiskCall::write, 0);
  commit_until_repaired(*db);
  EXPECT_TRUE(db->log().wait_until_durable(db->engine.latest().version, event_limit));
  EXPECT_FALSE(db->log().state().last_write_failed);
  db->engine.close();
  EXPECT_TRUE(db->log().close().ok());
  db.reset();
  expect_complete();
}

TEST_P(Fault, OfAFullDiskIsRepairedByFreeSpace) {
  auto db = std::make_unique<LoggedEngine>(disk_, options());
  ASSERT_TRUE(db->commit(model_, random_).done());
  disk_.set_capacity(20'000);
  EXPECT_TRUE(hil::tests::eventually(
      [&] {
        const Outcome& outcome = db->commit(model_, random_);
        EXPECT_TRUE(outcome.done() || outcome.refused_by == RefusedBy::log_fault) << describe(outcome);
        return db->log().state().faults > 0;
      },
      event_limit));
  EXPECT_NE(db->log().state().last_fault.find("No space left"), std::string::npos)
      << db->log().state().last_fault;
  disk_.set_capacity(~std::uint64_t{0});
  commit_until_repaired(*db);
  EXPECT_TRUE(db->log().wait_until_durable(db->engine.latest().version, event_limit));
  db->engine.close();
  EXPECT_TRUE(db->log().close().ok());
  db.reset();
  expect_complete();
}

TEST_P(Fault, DuringCloseIsReported) {
  {
    LoggedEngine db(disk_, options());
    ASSERT_TRUE(db.commit(model_, random_).done());
    ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
    disk_.fail_kind(DiskCall::write, EIO);
    db.engine.close();
    const auto closed = db.log().close();
    ASSERT_FALSE(closed.ok());
    EXPECT_NE(closed.error().message.find("Input/output error"), std::string::npos) << closed.error().message;
    disk_.fail_kind(DiskCall::write, 0);
  }
  expect_complete();
}

}  // namespace
}  // namespace rtstdb::transaction::test
