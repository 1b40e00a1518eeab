// The log thread runs out of memory at any allocation: it is handled as a disk failure, and repaired when
// there is memory again.

#include <filesystem>

#include "life.hpp"
#include "rtstdb/log/posix_disk.hpp"
#include "tests/support/failing_new.hpp"
#include "tests/support/rounds.hpp"

namespace rtstdb::transaction::test {
namespace {

class Memory : public testing::TestWithParam<DurabilityMode> {
 protected:
  Memory() {
    std::string pattern = (std::filesystem::temp_directory_path() / "hil_memory_XXXXXX").string();
    path_ = ::mkdtemp(pattern.data());
  }
  ~Memory() override { std::filesystem::remove_all(path_); }

  LifeOptions options() const {
    LifeOptions options;
    options.mode = GetParam();
    options.ring_bytes = 8192;
    options.segment_bytes = 4096;
    options.checkpoint_every_bytes = 2000;
    options.flush_interval = Nanoseconds(100'000);
    return options;
  }
  std::unique_ptr<CommitLog> open() const {
    auto log = CommitLog::open(std::move(log::open_directory(path_).value()), log_options(options()));
    EXPECT_TRUE(log.ok()) << log.error().message;
    return std::move(log).value();
  }
  /// Each transaction is completed, or refused because the log cannot be written.
  void commit_some(Life& life) {
    for (int k = 0; k < 40; ++k) {
      const Outcome& outcome = life.commit(model_, random_);
      ASSERT_TRUE(outcome.done() || outcome.refused_by == RefusedBy::log_fault) << describe(outcome);
      if (k % 8 == 7) life.log().wait_until_durable(life.engine.latest().version, Nanoseconds(2'000'000));
    }
  }
  void commit_until_durable(Life& life) {
    const ClockTime end = monotonic_.now() + long_time;
    while (!life.commit(model_, random_).done() && monotonic_.now() < end) {
    }
    ASSERT_TRUE(life.log().wait_until_durable(life.engine.latest().version, long_time))
        << life.log().state().last_fault;
  }
  void expect_all_there() {
    Life life(open(), options());
    EXPECT_EQ(describe(life.image()), describe(living(model_.now()))) << life.log().recovery().summary;
  }

  MonotonicClock monotonic_;
  std::filesystem::path path_;
  std::mt19937_64 random_{4};
  Model model_;
};

/// From one allocation that fails to the next.
const int step = hil::tests::is_long() ? one_in : 5 * one_in;

INSTANTIATE_TEST_SUITE_P(Durability, Memory, every_mode(), mode_name);

TEST_P(Memory, ThatRunsOutAnywhereIsRepaired) {
  int rounds = 0;
  {
    Life life(open(), options());
    ASSERT_TRUE(life.commit(model_, random_).done());
    bool failed = true;
    for (int after = 0; failed && !HasFailure(); after += step) {
      SCOPED_TRACE("after " + std::to_string(after) + " allocations");
      hil::test::fail_allocations_of("rtstdb log", after);
      commit_some(life);
      failed = hil::test::allocations_failed();
      hil::test::stop_failing_allocations();
      commit_until_durable(life);
      ++rounds;
    }
    EXPECT_GT(rounds, 1);
    EXPECT_NE(life.log().state().last_fault.find("memory"), std::string::npos)
        << life.log().state().last_fault;
    life.engine.close();
    EXPECT_TRUE(life.log().close().ok());
  }
  std::cout << rounds << " rounds\n";
  expect_all_there();
}

/// The durable version is there, and close() reports the failure.
TEST_P(Memory, ThatRunsOutAtCloseIsReported) {
  int refused = 0;
  bool failed = true;
  for (int after = 0; failed && !HasFailure(); after += step) {
    SCOPED_TRACE("after " + std::to_string(after) + " allocations");
    Version promised = 0;
    {
      Life life(open(), options());
      ASSERT_TRUE(model_.knows(life.engine.latest().version)) << life.log().recovery().summary;
      model_.go_on_at(life.engine.latest().version);
      hil::test::fail_allocations_of("rtstdb log", after);
      commit_some(life);
      life.engine.close();
      const auto closed = life.log().close();
      failed = hil::test::allocations_failed();
      hil::test::stop_failing_allocations();
      promised = closed.ok() ? model_.newest_up_to(~Version{0}) : life.log().durable();
      refused += closed.ok() ? 0 : 1;
      const bool told = closed.ok() || closed.error().message.find("memory") != std::string::npos;
      EXPECT_TRUE(told) << closed.error().message;
    }
    Life life(open(), options());
    EXPECT_GE(life.engine.latest().version, promised);
  }
  EXPECT_GT(refused, 0);
}

}  // namespace
}  // namespace rtstdb::transaction::test
