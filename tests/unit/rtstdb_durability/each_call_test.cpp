// Each disk operation in turn fails, with EIO, and with ENOSPC if that is possible. After an immediate power
// loss, the durable version is there; without one, the log repairs itself.
//
// The test drives the log thread step by step, on a clock that advances only when nothing else happens, so
// that each run makes the same disk operations.

#include <algorithm>
#include <cerrno>
#include <thread>

#include "life.hpp"

namespace rtstdb::transaction::test {
namespace {

constexpr int commits = 12;

/// Drives a log step by step, and advances the clock when it has nothing to do.
class Turns final : public LogDriver {
 public:
  explicit Turns(SimulatedClock& clock) : clock_(clock) {}
  void log_is_waited_for() noexcept override { take(); }
  bool take() {
    const auto step = log->work();
    if (!step.worked) clock_.advance(Nanoseconds(1'000'000));
    return step.worked;
  }
  CommitLog* log = nullptr;

 private:
  SimulatedClock& clock_;
};

enum class End : std::uint8_t { power_lost, made_well };

struct Failing {
  std::uint64_t call = ~std::uint64_t{0};  ///< counted from the end of the first log
  int error_number = EIO;
  End end = End::made_well;
};

class EachCall : public testing::TestWithParam<DurabilityMode> {
 protected:
  LifeOptions options() const {
    LifeOptions options;
    options.mode = GetParam();
    options.ring_bytes = 8192;
    options.segment_bytes = 8192;
    options.checkpoint_every_bytes = 3000;
    return options;
  }
  /// All operations, by kind.
  std::vector<DiskCall> live(const Failing& failing);
};

/// A disk with a log, and databases that continue it.
class Course {
 public:
  Course(const LifeOptions& options, const Failing& failing) : options_(options), failing_(failing) {
    begin();
    work();
    life_->engine.close();
    life_.reset();
    disk_.before_each([this](DiskCall call) { calls_.push_back(call); });
    disk_.fail_call(disk_.calls() + failing.call, failing.error_number);
  }
  void begin();
  void work();
  void become_well();
  void lose_power();
  void close();
  void look(Version at_least);

  Model model;
  Version promised = 0;
  const std::vector<DiskCall>& calls() const { return calls_; }

 private:
  const Outcome& commit();
  void turn() {
    life_->engine.call([&] { turns_.take(); });
    promised = std::max(promised, life_->log().durable());
  }
  bool has_failed() const { return calls_.size() > failing_.call; }

  const LifeOptions options_;
  const Failing failing_;
  SimulatedDisk disk_{5};
  SimulatedClock clock_;
  Turns turns_{clock_};
  std::mt19937_64 random_{5};
  std::unique_ptr<Life> life_;
  std::unique_ptr<Transaction> transaction_;
  std::vector<DiskCall> calls_;
};

void Course::begin() {
  CommitLogOptions options = log_options(options_);
  options.clock = &clock_;
  options.driver = &turns_;
  auto log = open_log(disk_, options);
  if (!log) {
    EXPECT_TRUE(has_failed());
    EXPECT_EQ(log.error().code, ErrorCode::file);
    log = open_log(disk_, options);
  }
  ASSERT_TRUE(log.ok()) << log.error().message;
  turns_.log = log.value().get();
  life_ = std::make_unique<Life>(std::move(log).value(), options_);
  transaction_ = life_->make();
}

const Outcome& Course::commit() {
  transaction_->begin({});
  model.declare(*transaction_, random_);
  life_->engine.submit(*transaction_);
  while (transaction_->status() == Status::pending) {
    if (life_->log().held() > 0)
      turn();
    else
      std::this_thread::yield();
  }
  const Outcome& outcome = transaction_->outcome();
  if (outcome.done()) model.is_done(outcome.version);
  if (outcome.in_doubt) model.may_be_done(outcome.version);
  return outcome;
}

void Course::work() {
  for (int k = 0; k < commits; ++k) {
    const Outcome& outcome = commit();
    const bool refused = outcome.refused_by == RefusedBy::log_fault;
    EXPECT_TRUE(outcome.done() || (refused && has_failed())) << describe(outcome);
    EXPECT_TRUE(outcome.done() || options_.mode != DurabilityMode::async) << describe(outcome);
    EXPECT_LE(outcome.durable ? outcome.version : 0, life_->log().durable()) << describe(outcome);
    const bool may_be_unsafe =
        options_.mode == DurabilityMode::async || (options_.mode == DurabilityMode::group && has_failed());
    EXPECT_TRUE(!outcome.done() || outcome.durable || may_be_unsafe) << describe(outcome);
    // Two steps write a group, or a part of a checkpoint.
    for (int turns = 0; turns < 2; ++turns)
      turn();
  }
}

/// After the fault: with time and further commits, everything gets to disk.
void Course::become_well() {
  for (int tries = 0; tries < 100; ++tries) {
    const Outcome& outcome = commit();
    for (int turns = 0; turns < 20; ++turns)
      turn();
    const bool whole = life_->log().durable() == life_->engine.latest().version;
    if (outcome.done() && whole && !life_->log().state().last_write_failed) return;
  }
  ADD_FAILURE() << "the log does not become well: " << life_->log().state().last_fault;
}

void Course::lose_power() {
  disk_.crash();
  disk_.fail_kind(DiskCall::create, EIO);
  disk_.fail_kind(DiskCall::remove, EIO);
  close();
  disk_.fail_kind(DiskCall::create, 0);
  disk_.fail_kind(DiskCall::remove, 0);
}

void Course::close() {
  transaction_.reset();
  life_->engine.close();
  promised = std::max(promised, life_->log().durable());
  life_.reset();
}

void Course::look(Version at_least) {
  begin();
  const Recovery recovery = life_->log().recovery();
  ASSERT_TRUE(model.knows(recovery.version)) << recovery.summary;
  EXPECT_GE(recovery.version, at_least) << recovery.summary;
  model.go_on_at(recovery.version);
  EXPECT_EQ(describe(life_->image()), describe(living(model.now()))) << recovery.summary;
  become_well();
  close();
}

std::vector<DiskCall> EachCall::live(const Failing& failing) {
  Course course(options(), failing);
  course.begin();
  course.work();
  if (failing.end == End::power_lost) {
    course.lose_power();
    course.look(course.model.newest_up_to(course.promised));
  } else {
    course.become_well();
    const Version newest = course.model.newest_up_to(course.promised);
    EXPECT_EQ(describe(course.model.now()), describe(course.model.image(newest))) << "all is on disk";
    course.close();
    course.look(newest);
  }
  return course.calls();
}

bool may_find_no_room(DiskCall call) {
  return call == DiskCall::create || call == DiskCall::write || call == DiskCall::preallocate ||
         call == DiskCall::rename;
}

TEST_P(EachCall, ThatFailsLosesNoDurableVersionAndIsRepaired) {
  for (const End end : {End::power_lost, End::made_well}) {
    const std::vector<DiskCall> calls = live({.end = end});
    ASSERT_EQ(calls, live({.end = end})) << "a life does not make the same calls again";
    ASSERT_GT(calls.size(), 60u);
    ASSERT_GT(std::ranges::count_if(calls, may_find_no_room), 20);
    for (std::uint64_t call = 0; call < calls.size() && !HasFailure(); call += one_in) {
      const log::DiskError fault{calls[call], EIO, "it"};
      SCOPED_TRACE("call " + std::to_string(call) + ", " + fault.describe() +
                   (end == End::power_lost ? ", then the power goes" : ""));
      live({call, EIO, end});
      if (may_find_no_room(calls[call])) live({call, ENOSPC, end});
    }
    std::cout << "each of " << calls.size() << " calls\n";
  }
}

INSTANTIATE_TEST_SUITE_P(Durability, EachCall, every_mode(), mode_name);

}  // namespace
}  // namespace rtstdb::transaction::test
