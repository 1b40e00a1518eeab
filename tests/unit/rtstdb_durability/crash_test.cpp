// A power loss at each disk operation in turn: the recovered state existed, and is not older than the durable
// version.

#include "logged_engine.hpp"

namespace rtstdb::transaction::test {
namespace {

class Crash : public testing::TestWithParam<DurabilityMode> {
 protected:
  LoggedEngineOptions options() const { return small_options(GetParam()); }
  /// Runs a database with this many commits and a power loss at one disk operation, then one that checks the
  /// recovered state. False: there was no such operation.
  bool run_with_crash(std::uint64_t crash_at_call, std::uint64_t seed);
  Version work(SimulatedDisk& disk, Model& model, std::mt19937_64& random, const std::atomic<bool>& crashed);
};

constexpr DiskCall all_calls[] = {DiskCall::create,      DiskCall::open,           DiskCall::read,
                                  DiskCall::write,       DiskCall::sync,           DiskCall::size,
                                  DiskCall::preallocate, DiskCall::list,           DiskCall::rename,
                                  DiskCall::remove,      DiskCall::sync_directory, DiskCall::lock};

/// Returns the newest version that an outcome or the log reported as durable.
Version Crash::work(SimulatedDisk& disk, Model& model, std::mt19937_64& random,
                    const std::atomic<bool>& crashed) {
  auto log = open_log(disk, log_options(options()));
  if (!log) return 0;
  LoggedEngine db(std::move(log).value(), options());
  Version durable = db.log().durable();
  for (int k = 0; k < 40 && !crashed; ++k) {
    const Outcome& outcome = db.commit(model, random);
    if (outcome.durable) durable = std::max(durable, outcome.version);
    EXPECT_TRUE(outcome.done() || outcome.status == Status::refused) << describe(outcome);
    EXPECT_EQ(outcome.refused_by, outcome.done() ? RefusedBy::none : RefusedBy::log_fault);
    // Otherwise async makes few disk operations.
    if (GetParam() == DurabilityMode::async && k % 3 == 0)
      db.log().wait_until_durable(outcome.version, Nanoseconds(50'000'000));
    durable = std::max(durable, db.log().durable());
  }
  db.engine.close();
  return std::max(durable, db.log().durable());
}

bool Crash::run_with_crash(std::uint64_t crash_at_call, std::uint64_t seed) {
  SimulatedDisk disk(seed);
  Model model;
  std::mt19937_64 random(seed);
  std::atomic<bool> crashed{false};
  disk.before_each([&](DiskCall) {
    if (disk.calls() != crash_at_call || crashed.exchange(true)) return;
    disk.crash();
    for (const DiskCall call : all_calls)
      disk.fail_kind(call, EIO);
  });
  Version durable = work(disk, model, random, crashed);
  disk.before_each(nullptr);
  for (const DiskCall call : all_calls)
    disk.fail_kind(call, 0);
  disk.kill();
  // Twice: a database that continues after a crash recovers too.
  for (int round = 0; round < 2; ++round) {
    auto log = open_log(disk, log_options(options()));
    EXPECT_TRUE(log.ok()) << log.error().message;
    if (!log) return crashed;
    const Recovery recovery = log.value()->recovery();
    EXPECT_TRUE(model.knows(recovery.version)) << recovery.summary;
    EXPECT_GE(recovery.version, model.newest_up_to(durable))
        << "durable were versions up to " << durable << "; " << recovery.summary;
    if (testing::Test::HasFailure()) return crashed;
    model.continue_at(recovery.version);
    {
      LoggedEngine db(std::move(log).value(), options());
      EXPECT_EQ(describe(db.image()), describe(without_generations(model.now()))) << recovery.summary;
      for (int k = 0; k < 5; ++k)
        EXPECT_TRUE(db.commit(model, random).done());
      EXPECT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
      durable = db.log().durable();
      EXPECT_EQ(durable, db.engine.latest().version);
    }
    disk.crash();
  }
  return crashed;
}

TEST_P(Crash, AtEachDiskOperationKeepsDurableVersions) {
  std::uint64_t call = 0;
  bool crashed = true;
  for (; crashed && !HasFailure(); call += one_in) {
    SCOPED_TRACE("crash at call " + std::to_string(call));
    crashed = run_with_crash(call, call + 1);
  }
  // The number of operations depends on how many commits shared a group.
  EXPECT_GT(call, 30u);
}

INSTANTIATE_TEST_SUITE_P(Durability, Crash, every_mode(), mode_name);

}  // namespace
}  // namespace rtstdb::transaction::test
