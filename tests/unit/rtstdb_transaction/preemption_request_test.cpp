// When the engine requests a preemption point early: while a run waits for the device, and one is useful.

#include <gtest/gtest.h>

#include "tests/support/eventually.hpp"
#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

class PreemptionRequest : public testing::Test {
 protected:
  /// Executes a reader and calls `event` in its first wait for the device.
  Status read(const std::function<void()>& event, const Terms& given = soft_terms(3)) {
    world_.executor.while_waiting = [&, done = false]() mutable {
      if (!std::exchange(done, true)) event();
    };
    return world_.execute(begin_query(*reader_, query_, given)).status;
  }
  bool requested() const { return world_.executor.preemption_requested(); }
  /// The engine has handled all earlier submissions when this write is committed.
  void write() {
    writer_->begin({});
    writer_->update(first_, row_of(2));
    EXPECT_EQ(world_.execute(*writer_).status, Status::committed);
  }

  World world_;
  EntityId first_ = world_.create(1);
  SimulatedQuery query_{1}, other_query_{1};
  std::unique_ptr<Transaction> reader_ = world_.make(), other_ = world_.make(), writer_ = world_.make();
};

TEST_F(PreemptionRequest, IsMadeForAHigherPriorityTransaction) {
  bool before = true, after = false;
  EXPECT_EQ(read([&] {
              before = requested();
              world_.engine.submit(begin_query(*other_, other_query_, soft_terms(7)));
              after = hil::tests::eventually([&] { return requested(); });
            }),
            Status::committed);
  EXPECT_FALSE(before);
  EXPECT_TRUE(after);
  EXPECT_EQ(world_.engine.wait(*other_).status, Status::committed);
  bool in_next_wait = true;
  read([&] { in_next_wait = requested(); });
  EXPECT_FALSE(in_next_wait);
}

TEST_F(PreemptionRequest, IsNotMadeForLowerPriorityOrForWrites) {
  bool after_query = true, after_write = true;
  read([&] {
    write();
    after_write = requested();
    world_.engine.submit(begin_query(*other_, other_query_, soft_terms(2)));
    write();
    after_query = requested();
  });
  EXPECT_FALSE(after_write) << "the write helper thread executes it";
  EXPECT_FALSE(after_query);
  EXPECT_EQ(world_.engine.wait(*other_).status, Status::committed);
}

TEST_F(PreemptionRequest, IsMadeByCancellation) {
  bool after = false;
  read([&] {
    world_.engine.cancel(*reader_);
    after = requested();
  });
  EXPECT_TRUE(after);
}

TEST_F(PreemptionRequest, IsMadeWhenTheFirmDeadlinePasses) {
  bool before = true, after = false;
  const auto pass_deadline = [&] {
    before = requested();
    world_.clock.advance(11ms);
    after = requested();
  };
  EXPECT_EQ(read(pass_deadline, terms(DeadlineClass::firm, world_.clock.now() + 10ms)), Status::missed);
  EXPECT_FALSE(before);
  EXPECT_TRUE(after);
}

}  // namespace
}  // namespace rtstdb::transaction::test
