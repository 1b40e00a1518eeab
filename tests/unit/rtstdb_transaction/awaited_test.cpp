// When the chunk under way may end early: while a transaction waits for the device, whether a gap would be of
// use.

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

class Awaited : public testing::Test {
 protected:
  /// A reader of importance 3 runs, and `happens` in its first wait for the device. Again: when nobody runs
  /// any more.
  Status read(const std::function<void()>& happens,
              const Terms& given = terms(DeadlineClass::soft, ClockTime::max(), 3)) {
    world_.executor.while_waiting = [&, done = false]() mutable {
      if (!std::exchange(done, true)) happens();
    };
    reader_->begin(given);
    reader_->add_query(query_, 1);
    return world_.execute(*reader_).status;
  }
  void submit_other(std::uint8_t importance) {
    other_->begin(terms(DeadlineClass::soft, ClockTime::max(), importance));
    other_->add_query(other_query_, 1);
    world_.engine.submit(*other_);
  }
  /// The write helper's thread has to see it.
  bool becomes_awaited() {
    for (int k = 0; k < 5'000 && !world_.executor.preemption_requested(); ++k)
      std::this_thread::sleep_for(1ms);
    return world_.executor.preemption_requested();
  }
  /// What was submitted before has been looked at: this was afterwards.
  void write_meanwhile() {
    writer_->begin({});
    writer_->update(first_, row_of(2));
    EXPECT_EQ(world_.execute(*writer_).status, Status::committed);
  }

  World world_;
  EntityId first_ = world_.create(1);
  SimulatedQuery query_{1}, other_query_{1};
  std::unique_ptr<Transaction> reader_ = world_.make(), other_ = world_.make(), writer_ = world_.make();
};

TEST_F(Awaited, ByOneThatGoesBefore) {
  bool before = true, after = false;
  EXPECT_EQ(read([&] {
              before = world_.executor.preemption_requested();
              submit_other(7);
              after = becomes_awaited();
            }),
            Status::committed);
  EXPECT_FALSE(before);
  EXPECT_TRUE(after);
  EXPECT_EQ(world_.engine.wait(*other_).status, Status::committed);
  bool later = true;
  read([&] { later = world_.executor.preemption_requested(); });
  EXPECT_FALSE(later) << "that was another wait";
}

TEST_F(Awaited, ByNoneThatGoesBehind) {
  bool awaited = true;
  read([&] {
    submit_other(2);
    write_meanwhile();
    awaited = world_.executor.preemption_requested();
  });
  EXPECT_FALSE(awaited);
  EXPECT_EQ(world_.engine.wait(*other_).status, Status::committed);
}

TEST_F(Awaited, ByNoWriteThatIsCarriedOutMeanwhile) {
  bool awaited = true;
  read([&] {
    write_meanwhile();
    awaited = world_.executor.preemption_requested();
  });
  EXPECT_FALSE(awaited);
}

TEST_F(Awaited, ByWhoeverCancelsIt) {
  bool awaited = false;
  read([&] {
    world_.engine.cancel(*reader_);
    awaited = world_.executor.preemption_requested();
  });
  EXPECT_TRUE(awaited);
}

TEST_F(Awaited, OnceItsFirmDeadlineHasPassed) {
  bool before = true, after = false;
  const ClockTime deadline = world_.clock.now() + 10ms;
  EXPECT_EQ(read(
                [&] {
                  before = world_.executor.preemption_requested();
                  world_.clock.advance(11ms);
                  after = world_.executor.preemption_requested();
                },
                terms(DeadlineClass::firm, deadline)),
            Status::missed);
  EXPECT_FALSE(before);
  EXPECT_TRUE(after);
}

}  // namespace
}  // namespace rtstdb::transaction::test
