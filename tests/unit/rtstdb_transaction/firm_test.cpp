// A firm transaction is published before its deadline or never. tests/long runs loads of them.

#include <gtest/gtest.h>

#include <set>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

class FirmDeadline : public testing::Test {
 protected:
  /// Runs a firm update whose clock jumps past the deadline before the n-th reading after its queries.
  const Outcome& run_with_jump(int reading) {
    world_.executor.work = [this, reading](const auto&, const auto&, const auto&) {
      world_.clock.jump_before_reading(reading, 2ms);
      return query::RunReport{};
    };
    transaction_->begin(terms(DeadlineClass::firm, world_.clock.peek() + 1ms));
    transaction_->update(entity_, row_of(2));
    created_ = transaction_->create(row_of(3));
    transaction_->add_query(query_, 1);
    return world_.execute(*transaction_);
  }

  World world_;
  EntityId entity_ = world_.create(1);
  SimulatedQuery query_{1};
  std::unique_ptr<Transaction> transaction_ = world_.make();
  std::uint32_t created_ = 0;
};

// After the queries the engine reads the clock for `computed`, for `published`, and after the hand-back.
TEST_F(FirmDeadline, PassingBeforePublicationDiscardsTheVersion) {
  const Outcome& outcome = run_with_jump(2);
  EXPECT_LT(outcome.computed, transaction_->outcome().submitted + 1ms) << "computed in time";
  EXPECT_EQ(outcome.status, Status::missed);
  EXPECT_EQ(outcome.lateness, 1ms);
  EXPECT_EQ(world_.mask(entity_), 1) << "discarded";
  EXPECT_EQ(world_.engine.latest().version, 1u);
  EXPECT_FALSE(transaction_->created(created_).valid());

  Version device_version = 2;  // the executor has the discarded version
  std::vector<std::uint32_t> changed;
  world_.executor.work = [&](const store::RowSource& rows, const auto&, const auto&) {
    EXPECT_TRUE(rows.changed_between(device_version, changed));
    return query::RunReport{};
  };
  transaction_->begin({});
  transaction_->add_query(query_, 1);
  EXPECT_EQ(world_.execute(*transaction_).version, 1u);
  EXPECT_EQ(std::set<std::uint32_t>(changed.begin(), changed.end()), (std::set<std::uint32_t>{0, 1}));

  EXPECT_EQ(world_.create(9), (EntityId{1, 1})) << "indices and generations are not used up";
  EXPECT_EQ(world_.engine.latest().version, 3u) << "the version number is not used again";
}

TEST_F(FirmDeadline, PassingAfterPublicationKeepsTheVersion) {
  const Outcome& outcome = run_with_jump(3);
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(world_.mask(entity_), 2);
  EXPECT_EQ(world_.engine.counts().firm_late_commits, 0u);
  EXPECT_EQ(world_.engine.counts().firm_delivered_late, 1u);
}

TEST_F(FirmDeadline, AtTheMinimumOfTimeGivesTheMaximumLateness) {
  world_.clock.advance(1ms);
  for (const DeadlineClass deadline_class : {DeadlineClass::firm, DeadlineClass::soft, DeadlineClass::hard}) {
    transaction_->begin(terms(deadline_class, ClockTime::min()));
    transaction_->update(entity_, row_of(2));
    const Outcome& outcome = world_.execute(*transaction_);
    EXPECT_EQ(outcome.status, deadline_class == DeadlineClass::firm ? Status::missed : Status::late);
    EXPECT_EQ(outcome.lateness, Nanoseconds::max());
  }
}

TEST_F(FirmDeadline, IncludesItsInstant) {
  world_.executor.work = [this](const auto&, const auto&, const auto&) {
    world_.clock.advance(1ms);
    return query::RunReport{};
  };
  for (const auto& [margin, status] : {std::pair(0ns, Status::committed), std::pair(-1ns, Status::missed)}) {
    transaction_->begin(terms(DeadlineClass::firm, world_.clock.peek() + 1ms + margin));
    transaction_->update(entity_, row_of(5));
    transaction_->add_query(query_, 1);
    EXPECT_EQ(world_.execute(*transaction_).status, status);
  }
}

}  // namespace
}  // namespace rtstdb::transaction::test
