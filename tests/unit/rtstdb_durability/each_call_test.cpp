// Each disk operation in turn fails, with EIO, and with ENOSPC if that is possible. The durable version
// survives an immediate power loss; without one, the log repairs itself.
//
// The test executes the steps of the log thread, on a clock that advances only when a step has nothing to do,
// so that each run makes the same disk operations.

#include <algorithm>
#include <cerrno>
#include <thread>

#include "logged_engine.hpp"

namespace rtstdb::transaction::test {
namespace {

constexpr int commits = 12;

/// Executes the steps of a log, and advances the clock when one has nothing to do.
class StepDriver final : public LogDriver {
 public:
  explicit StepDriver(SimulatedClock& clock) : clock_(clock) {}
  void log_is_waited_for() noexcept override { step(); }
  bool step() {
    const auto step = log->work();
    if (!step.worked) clock_.advance(Nanoseconds(1'000'000));
    return step.worked;
  }
  CommitLog* log = nullptr;

 private:
  SimulatedClock& clock_;
};

enum class End : std::uint8_t { power_lost, repaired };

struct FailingCall {
  std::uint64_t call = ~std::uint64_t{0};  ///< counted from the end of the first log
  int error_number = EIO;
  End end = End::repaired;
};

class EachCall : public testing::TestWithParam<DurabilityMode> {
 protected:
  LoggedEngineOptions options() const {
    LoggedEngineOptions options;
    options.mode = GetParam();
    options.ring_bytes = 8192;
    options.segment_bytes = 8192;
    options.checkpoint_every_bytes = 3000;
    return options;
  }
  /// All operations, by kind.
  std::vector<DiskCall> run(const FailingCall& failing);
};

/// A disk with a log, and the databases that use it one after the other.
class Databases {
 public:
  Databases(const LoggedEngineOptions& options, const FailingCall& failing)
      : options_(options), failing_(failing) {
    begin();
    work();
    db_->engine.close();
    db_.reset();
    disk_.before_each([this](DiskCall call) { calls_.push_back(call); });
    disk_.fail_call(disk_.calls() + failing.call, failing.error_number);
  }
  void begin();
  void work();
  void repair();
  void lose_power();
  void close();
  void expect_recovery(Version at_least);

  Model model;
  Version durable = 0;
  const std::vector<DiskCall>& calls() const { return calls_; }

 private:
  const Outcome& commit();
  void step() {
    db_->engine.call([&] { driver_.step(); });
    durable = std::max(durable, db_->log().durable());
  }
  bool has_failed() const { return calls_.size() > failing_.call; }

  const LoggedEngineOptions options_;
  const FailingCall failing_;
  SimulatedDisk disk_{5};
  SimulatedClock clock_;
  StepDriver driver_{clock_};
  std::mt19937_64 random_{5};
  std::unique_ptr<LoggedEngine> db_;
  std::unique_ptr<Transaction> transaction_;
  std::vector<DiskCall> calls_;
};

void Databases::begin() {
  CommitLogOptions options = log_options(options_);
  options.clock = &clock_;
  options.driver = &driver_;
  auto log = open_log(disk_, options);
  if (!log) {
    EXPECT_TRUE(has_failed());
    EXPECT_EQ(log.error().code, ErrorCode::file);
    log = open_log(disk_, options);
  }
  ASSERT_TRUE(log.ok()) << log.error().message;
  driver_.log = log.value().get();
  db_ = std::make_unique<LoggedEngine>(std::move(log).value(), options_);
  transaction_ = db_->make();
}

const Outcome& Databases::commit() {
  transaction_->begin({});
  model.declare(*transaction_, random_);
  db_->engine.submit(*transaction_);
  while (transaction_->status() == Status::pending) {
    if (db_->log().held() > 0)
      step();
    else
      std::this_thread::yield();
  }
  const Outcome& outcome = transaction_->outcome();
  if (outcome.done()) model.commit(outcome.version);
  if (outcome.in_doubt) model.commit_in_doubt(outcome.version);
  return outcome;
}

void Databases::work() {
  for (int k = 0; k < commits; ++k) {
    const Outcome& outcome = commit();
    const bool refused = outcome.refused_by == RefusedBy::log_fault;
    EXPECT_TRUE(outcome.done() || (refused && has_failed())) << describe(outcome);
    EXPECT_TRUE(outcome.done() || options_.mode != DurabilityMode::async) << describe(outcome);
    EXPECT_LE(outcome.durable ? outcome.version : 0, db_->log().durable()) << describe(outcome);
    const bool may_be_unsafe =
        options_.mode == DurabilityMode::async || (options_.mode == DurabilityMode::group && has_failed());
    EXPECT_TRUE(!outcome.done() || outcome.durable || may_be_unsafe) << describe(outcome);
    // Two steps write a group, or a part of a checkpoint.
    for (int steps = 0; steps < 2; ++steps)
      step();
  }
}

/// Commits until everything is on disk again.
void Databases::repair() {
  for (int commit_number = 0; commit_number < 100; ++commit_number) {
    const Outcome& outcome = commit();
    for (int steps = 0; steps < 20; ++steps)
      step();
    const bool all_durable = db_->log().durable() == db_->engine.latest().version;
    if (outcome.done() && all_durable && !db_->log().state().last_write_failed) return;
  }
  ADD_FAILURE() << "the log is not repaired: " << db_->log().state().last_fault;
}

void Databases::lose_power() {
  disk_.crash();
  disk_.fail_kind(DiskCall::create, EIO);
  disk_.fail_kind(DiskCall::remove, EIO);
  close();
  disk_.fail_kind(DiskCall::create, 0);
  disk_.fail_kind(DiskCall::remove, 0);
}

void Databases::close() {
  transaction_.reset();
  db_->engine.close();
  durable = std::max(durable, db_->log().durable());
  db_.reset();
}

void Databases::expect_recovery(Version at_least) {
  begin();
  const Recovery recovery = db_->log().recovery();
  ASSERT_TRUE(model.knows(recovery.version)) << recovery.summary;
  EXPECT_GE(recovery.version, at_least) << recovery.summary;
  model.continue_at(recovery.version);
  EXPECT_EQ(describe(db_->image()), describe(without_generations(model.now()))) << recovery.summary;
  repair();
  close();
}

std::vector<DiskCall> EachCall::run(const FailingCall& failing) {
  Databases databases(options(), failing);
  databases.begin();
  databases.work();
  if (failing.end == End::power_lost) {
    databases.lose_power();
    databases.expect_recovery(databases.model.newest_up_to(databases.durable));
  } else {
    databases.repair();
    const Version newest = databases.model.newest_up_to(databases.durable);
    EXPECT_EQ(describe(databases.model.now()), describe(databases.model.image(newest))) << "all is on disk";
    databases.close();
    databases.expect_recovery(newest);
  }
  return databases.calls();
}

bool needs_space(DiskCall call) {
  return call == DiskCall::create || call == DiskCall::write || call == DiskCall::preallocate ||
         call == DiskCall::rename;
}

TEST_P(EachCall, ThatFailsLosesNoDurableVersionAndIsRepaired) {
  for (const End end : {End::power_lost, End::repaired}) {
    const std::vector<DiskCall> calls = run({.end = end});
    ASSERT_EQ(calls, run({.end = end})) << "two runs differ";
    ASSERT_GT(calls.size(), 60u);
    ASSERT_GT(std::ranges::count_if(calls, needs_space), 20);
    for (std::uint64_t call = 0; call < calls.size() && !HasFailure(); call += one_in) {
      const log::DiskError fault{calls[call], EIO, "it"};
      SCOPED_TRACE("call " + std::to_string(call) + ", " + fault.describe() +
                   (end == End::power_lost ? ", then a power loss" : ""));
      run({call, EIO, end});
      if (needs_space(calls[call])) run({call, ENOSPC, end});
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Durability, EachCall, every_mode(), mode_name);

}  // namespace
}  // namespace rtstdb::transaction::test
