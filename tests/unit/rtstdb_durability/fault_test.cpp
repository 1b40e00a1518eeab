// A disk that fails once, always, or is full: no transaction waits for ever, none is reported as durable that
// is not, and after the failure the log is complete.

#include <cerrno>
#include <thread>

#include "life.hpp"

namespace rtstdb::transaction::test {
namespace {

class Fault : public testing::TestWithParam<DurabilityMode> {
 protected:
  LifeOptions options() const {
    LifeOptions options;
    options.mode = GetParam();
    options.ring_bytes = 8192;
    options.segment_bytes = 8192;
    options.checkpoint_every_bytes = 6000;
    options.flush_interval = Nanoseconds(100'000);
    return options;
  }
  /// Commits until one is completed and, except in async mode, durable.
  void commit_until_well(Life& life) {
    const ClockTime end = monotonic_.now() + long_time;
    while (monotonic_.now() < end) {
      const Outcome& outcome = life.commit(model_, random_);
      if (outcome.done() && (outcome.durable || GetParam() == DurabilityMode::async)) return;
    }
    ADD_FAILURE() << "the log does not become well again: " << life.log().state().last_fault;
  }
  void expect_all_there() {
    Life life(disk_, options());
    EXPECT_EQ(life.engine.latest().version, model_.newest_up_to(life.engine.latest().version))
        << life.log().recovery().summary;
    EXPECT_EQ(describe(life.image()), describe(living(model_.now()))) << life.log().recovery().summary;
  }

  MonotonicClock monotonic_;
  SimulatedDisk disk_{3};
  std::mt19937_64 random_{3};
  Model model_;
};

INSTANTIATE_TEST_SUITE_P(Durability, Fault, every_mode(), mode_name);

TEST_P(Fault, OfOneOperationIsRepaired) {
  for (int life_number = 0; life_number < 60 / one_in && !HasFailure(); ++life_number) {
    SCOPED_TRACE("life " + std::to_string(life_number));
    auto log = open_log(disk_, log_options(options()));
    if (!log) log = open_log(disk_, log_options(options()));  // the fault hit this open instead
    ASSERT_TRUE(log.ok()) << log.error().message;
    Life life(std::move(log).value(), options());
    disk_.fail_call(disk_.calls() + random_() % 40, EIO);
    for (int k = 0; k < 12; ++k) {
      const Outcome& outcome = life.commit(model_, random_);
      ASSERT_TRUE(outcome.done() || outcome.refused_by == RefusedBy::log_fault) << describe(outcome);
      ASSERT_LE(outcome.durable ? outcome.version : 0, life.log().durable());
    }
    commit_until_well(life);
    ASSERT_TRUE(life.log().wait_until_durable(life.engine.latest().version, long_time))
        << life.log().state().last_fault;
  }
  bool opened = false;  // until no fault is left for the database that checks
  for (int tries = 0; tries < 60 && !opened; ++tries)
    opened = open_log(disk_, log_options(options())).ok();
  ASSERT_TRUE(opened);
  expect_all_there();
}

// The next retry of a checkpoint may be a second away.
TEST_P(Fault, OfCheckpointsDelaysNoCommit) {
  LifeOptions calm = options();
  calm.segment_bytes = 1 << 20;
  Life life(disk_, calm);
  ASSERT_TRUE(life.commit(model_, random_).done());
  ASSERT_TRUE(life.log().wait_until_durable(life.engine.latest().version, long_time));
  int created = 0;
  disk_.before_each([&](DiskCall call) {  // after the segment that replaces the failed one
    if (call == DiskCall::create && ++created == 2) disk_.fail_kind(DiskCall::create, EIO);
  });
  disk_.fail_call(disk_.calls() + 1, EIO);
  life.commit(model_, random_);
  const ClockTime end = monotonic_.now() + long_time;
  const auto until = [&](const auto& happened) {
    while (!happened() && monotonic_.now() < end)
      std::this_thread::sleep_for(Nanoseconds(1'000'000));
    return happened();
  };
  ASSERT_TRUE(until([&] { return life.log().state().faults >= 8; })) << life.log().state().last_fault;
  for (int k = 0; k < 4 && GetParam() == DurabilityMode::async; ++k) {
    const std::uint64_t groups = life.log().state().groups;
    const ClockTime begun = monotonic_.now();
    ASSERT_TRUE(life.commit(model_, random_).done());
    ASSERT_TRUE(until([&] { return life.log().state().groups > groups; }));
    EXPECT_LT(monotonic_.now() - begun, Nanoseconds(300'000'000));
  }
  disk_.before_each({});
  disk_.fail_kind(DiskCall::create, 0);
  commit_until_well(life);
}

TEST_P(Fault, OfAllWritesIsReportedAndRepaired) {
  auto life = std::make_unique<Life>(disk_, options());
  ASSERT_TRUE(life->commit(model_, random_).done());
  ASSERT_TRUE(life->log().wait_until_durable(life->engine.latest().version, long_time));
  const Version safe = life->log().durable();
  disk_.fail_kind(DiskCall::write, EIO);
  bool refused = false;
  for (int k = 0; k < 100; ++k) {
    const Outcome& outcome = life->commit(model_, random_);
    EXPECT_FALSE(outcome.durable);
    ASSERT_TRUE(outcome.done() || GetParam() != DurabilityMode::async) << describe(outcome);
    if (outcome.status == Status::refused) {
      refused = true;
      EXPECT_EQ(outcome.refused_by, RefusedBy::log_fault);
      EXPECT_NE(describe(outcome).find("disk refuses"), std::string::npos);
    }
  }
  EXPECT_EQ(refused, GetParam() != DurabilityMode::async);
  EXPECT_FALSE(life->log().wait_until_durable(safe + 1, Nanoseconds(20'000'000)));
  const Durability state = life->log().state();
  EXPECT_TRUE(state.last_write_failed);
  EXPECT_GT(state.faults, 0u);
  EXPECT_NE(state.last_fault.find("write of segment."), std::string::npos) << state.last_fault;
  EXPECT_EQ(state.durable, safe);
  disk_.fail_kind(DiskCall::write, 0);
  commit_until_well(*life);
  EXPECT_TRUE(life->log().wait_until_durable(life->engine.latest().version, long_time));
  EXPECT_FALSE(life->log().state().last_write_failed);
  life->engine.close();
  EXPECT_TRUE(life->log().close().ok());
  life.reset();
  expect_all_there();
}

TEST_P(Fault, OfAFullDiskIsRepairedByFreeSpace) {
  auto life = std::make_unique<Life>(disk_, options());
  ASSERT_TRUE(life->commit(model_, random_).done());
  disk_.set_capacity(20'000);
  const ClockTime end = monotonic_.now() + long_time;
  while (life->log().state().faults == 0 && monotonic_.now() < end) {
    const Outcome& outcome = life->commit(model_, random_);
    ASSERT_TRUE(outcome.done() || outcome.refused_by == RefusedBy::log_fault) << describe(outcome);
  }
  EXPECT_NE(life->log().state().last_fault.find("No space left"), std::string::npos)
      << life->log().state().last_fault;
  disk_.set_capacity(~std::uint64_t{0});
  commit_until_well(*life);
  EXPECT_TRUE(life->log().wait_until_durable(life->engine.latest().version, long_time));
  life->engine.close();
  EXPECT_TRUE(life->log().close().ok());
  life.reset();
  expect_all_there();
}

TEST_P(Fault, AtTheEndIsReported) {
  {
    Life life(disk_, options());
    ASSERT_TRUE(life.commit(model_, random_).done());
    ASSERT_TRUE(life.log().wait_until_durable(life.engine.latest().version, long_time));
    disk_.fail_kind(DiskCall::write, EIO);
    life.engine.close();
    const auto closed = life.log().close();
    ASSERT_FALSE(closed.ok());
    EXPECT_NE(closed.error().message.find("Input/output error"), std::string::npos) << closed.error().message;
    disk_.fail_kind(DiskCall::write, 0);
  }
  expect_all_there();
}

}  // namespace
}  // namespace rtstdb::transaction::test
