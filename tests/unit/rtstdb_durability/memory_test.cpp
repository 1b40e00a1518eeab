// An allocation of the log thread fails: the log handles it as a disk failure, and repairs itself when there
// is memory again.

#include "logged_engine.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/failing_new.hpp"
#include "tests/support/rounds.hpp"
#include "tests/support/temporary_folder.hpp"

namespace rtstdb::transaction::test {
namespace {

class OutOfMemory : public testing::TestWithParam<DurabilityMode> {
 protected:
  LoggedEngineOptions options() const {
    LoggedEngineOptions options = small_options(GetParam());
    options.segment_bytes = 4096;
    options.checkpoint_every_bytes = 2000;
    return options;
  }
  std::unique_ptr<CommitLog> open() const {
    auto log =
        CommitLog::open(std::move(log::open_directory(folder_.path()).value()), log_options(options()));
    EXPECT_TRUE(log.ok()) << log.error().message;
    return std::move(log).value();
  }
  /// Each transaction is completed, or refused because the log cannot be written.
  void commit_some(LoggedEngine& db) {
    for (int k = 0; k < 40; ++k) {
      const Outcome& outcome = db.commit(model_, random_);
      ASSERT_TRUE(outcome.done() || outcome.refused_by == RefusedBy::log_fault) << describe(outcome);
      if (k % 8 == 7) db.log().wait_until_durable(db.engine.latest().version, Nanoseconds(2'000'000));
    }
  }
  void commit_until_durable(LoggedEngine& db) {
    ASSERT_TRUE(hil::tests::eventually([&] { return db.commit(model_, random_).done(); }, event_limit));
    ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit))
        << db.log().state().last_fault;
  }
  void expect_complete() {
    LoggedEngine db(open(), options());
    EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())))
        << db.log().recovery().summary;
  }

  hil::tests::TemporaryFolder folder_;
  std::mt19937_64 random_{4};
  Model model_;
};

/// Distance between the allocations that fail.
const int step = hil::tests::is_long() ? one_in : 5 * one_in;

INSTANTIATE_TEST_SUITE_P(Durability, OutOfMemory, every_mode(), mode_name);

TEST_P(OutOfMemory, AtAnyAllocationIsRepaired) {
  int rounds = 0;
  {
    LoggedEngine db(open(), options());
    ASSERT_TRUE(db.commit(model_, random_).done());
    bool failed = true;
    for (int after = 0; failed && !HasFailure(); after += step) {
      SCOPED_TRACE("after " + std::to_string(after) + " allocations");
      hil::tests::fail_allocations_of("rtstdb log", after);
      commit_some(db);
      failed = hil::tests::allocations_failed();
      hil::tests::stop_failing_allocations();
      commit_until_durable(db);
      ++rounds;
    }
    EXPECT_GT(rounds, 1);
    EXPECT_NE(db.log().state().last_fault.find("memory"), std::string::npos) << db.log().state().last_fault;
    db.engine.close();
    EXPECT_TRUE(db.log().close().ok());
  }
  expect_complete();
}

/// The durable version survives, and close() reports the failure.
TEST_P(OutOfMemory, AtCloseIsReported) {
  int refused = 0;
  bool failed = true;
  for (int after = 0; failed && !HasFailure(); after += step) {
    SCOPED_TRACE("after " + std::to_string(after) + " allocations");
    Version durable = 0;
    {
      LoggedEngine db(open(), options());
      ASSERT_TRUE(model_.knows(db.engine.latest().version)) << db.log().recovery().summary;
      model_.continue_at(db.engine.latest().version);
      hil::tests::fail_allocations_of("rtstdb log", after);
      commit_some(db);
      db.engine.close();
      const auto closed = db.log().close();
      failed = hil::tests::allocations_failed();
      hil::tests::stop_failing_allocations();
      durable = closed.ok() ? model_.newest_up_to(~Version{0}) : db.log().durable();
      refused += closed.ok() ? 0 : 1;
      const bool reported = closed.ok() || closed.error().message.find("memory") != std::string::npos;
      EXPECT_TRUE(reported) << closed.error().message;
    }
    LoggedEngine db(open(), options());
    EXPECT_GE(db.engine.latest().version, durable);
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace rtstdb::transaction::test
