// The power goes at every call of the disk in turn: what is there afterwards is a state that was, and not
// before what was promised.

#include "life.hpp"

namespace rtstdb::transaction::test {
namespace {

class Crash : public testing::TestWithParam<DurabilityMode> {
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

  /// A life with so many commits, in which the power goes at a call, and the next one, which looks at what is
  /// left. False: there was no such call.
  bool live_and_look(std::uint64_t crash_at_call, std::uint64_t seed);
  Version work(SimulatedDisk& disk, Model& model, std::mt19937_64& random, const std::atomic<bool>& crashed);
};

constexpr DiskCall all_calls[] = {DiskCall::create,      DiskCall::open,           DiskCall::read,
                                  DiskCall::write,       DiskCall::sync,           DiskCall::size,
                                  DiskCall::preallocate, DiskCall::list,           DiskCall::rename,
                                  DiskCall::remove,      DiskCall::sync_directory, DiskCall::lock};

/// Returns what was promised: the newest version that a transaction was told, or the log told, is on disk.
Version Crash::work(SimulatedDisk& disk, Model& model, std::mt19937_64& random,
                    const std::atomic<bool>& crashed) {
  auto log = open_log(disk, log_options(options()));
  if (!log) return 0;
  Life life(std::move(log).value(), options());
  Version promised = life.log().durable();
  for (int k = 0; k < 40 && !crashed; ++k) {
    const Outcome& outcome = life.commit(model, random);
    if (outcome.durable) promised = std::max(promised, outcome.version);
    EXPECT_TRUE(outcome.done() || outcome.status == Status::refused) << describe(outcome);
    EXPECT_EQ(outcome.refused_by, outcome.done() ? RefusedBy::none : RefusedBy::log_fault);
    // Async has few calls of the disk else.
    if (GetParam() == DurabilityMode::async && k % 3 == 0)
      life.log().wait_until_durable(outcome.version, Nanoseconds(50'000'000));
    promised = std::max(promised, life.log().durable());
  }
  life.engine.close();
  return std::max(promised, life.log().durable());
}

bool Crash::live_and_look(std::uint64_t crash_at_call, std::uint64_t seed) {
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
  Version promised = work(disk, model, random, crashed);
  disk.before_each(nullptr);
  for (const DiskCall call : all_calls)
    disk.fail_kind(call, 0);
  disk.kill();
  // And again, twice: a life that goes on behind a crash has to be as good as the first.
  for (int lives = 0; lives < 2; ++lives) {
    auto log = open_log(disk, log_options(options()));
    EXPECT_TRUE(log.ok()) << log.error().message;
    if (!log) return crashed;
    const Recovery recovery = log.value()->recovery();
    EXPECT_TRUE(model.knows(recovery.version)) << recovery.summary;
    EXPECT_GE(recovery.version, model.newest_up_to(promised))
        << "promised were " << promised << "; " << recovery.summary;
    if (testing::Test::HasFailure()) return crashed;
    model.go_on_at(recovery.version);
    {
      Life life(std::move(log).value(), options());
      EXPECT_EQ(describe(life.image()), describe(living(model.now()))) << recovery.summary;
      for (int k = 0; k < 5; ++k)
        EXPECT_TRUE(life.commit(model, random).done());
      EXPECT_TRUE(life.log().wait_until_durable(life.engine.latest().version, long_time));
      promised = life.log().durable();
      EXPECT_EQ(promised, life.engine.latest().version);
    }
    disk.crash();
  }
  return crashed;
}

TEST_P(Crash, AtEveryCallOfTheDisk) {
  std::uint64_t call = 0;
  bool there = true;
  for (; there && !HasFailure(); call += one_in) {
    SCOPED_TRACE("crash at call " + std::to_string(call));
    there = live_and_look(call, call + 1);
  }
  // How many calls there are depends on how many commits shared a group.
  EXPECT_GT(call, 30u);
}

INSTANTIATE_TEST_SUITE_P(Durability, Crash, every_mode(), mode_name);

}  // namespace
}  // namespace rtstdb::transaction::test
