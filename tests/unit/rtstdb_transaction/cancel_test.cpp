// Cancelling transactions in each state. tests/long cancels them at each reading of the clock.

#include <gtest/gtest.h>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

class Cancellation : public testing::Test {
 protected:
  static constexpr std::uint32_t batch = 5 * unmeasured_chunk;

  Cancellation() {
    world_.executor.chunk = [this](const auto&, const auto&, std::uint32_t first, std::uint32_t) {
      world_.clock.advance(500us);
      if (in_chunk) in_chunk(first / unmeasured_chunk);
    };
  }
  void declare(Transaction& transaction) {
    transaction.begin({});
    transaction.update(entity_, row_of(2));
    transaction.add_query(query_, batch);
  }

  World world_;
  EntityId entity_ = world_.create(1);
  SimulatedQuery query_{batch};
  std::unique_ptr<Transaction> transaction_ = world_.make();
  std::unique_ptr<Transaction> other_ = world_.make();
  std::function<void(std::uint32_t)> in_chunk;
};

TEST_F(Cancellation, StopsARunAtItsNextPreemptionPoint) {
  std::uint32_t last = 0;
  in_chunk = [&](std::uint32_t chunk) {
    last = chunk;
    if (chunk == 2) world_.engine.cancel(*transaction_);
  };
  declare(*transaction_);
  const Outcome& outcome = world_.execute(*transaction_);
  EXPECT_EQ(outcome.status, Status::cancelled);
  EXPECT_EQ(outcome.cancelled_by, CancelledBy::caller);
  EXPECT_EQ(describe(outcome), "cancelled by its caller; nothing was done");
  EXPECT_EQ(last, 2u);
  EXPECT_EQ(world_.mask(entity_), 1);
  in_chunk = nullptr;
  declare(*transaction_);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::committed) << "begun again";
}

TEST_F(Cancellation, EndsAWaitingTransactionWhileAnotherRuns) {
  in_chunk = [&](std::uint32_t chunk) {
    if (chunk != 1) return;
    other_->begin({});
    other_->create(row_of(1));
    other_->remove({63, 1});  // bad input, if it runs
    SimulatedQuery query(1);
    other_->add_query(query, 1);
    world_.engine.submit(*other_);
    world_.engine.cancel(*other_);
    EXPECT_EQ(world_.engine.wait(*other_).status, Status::cancelled);
  };
  declare(*transaction_);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::committed);
}

TEST_F(Cancellation, StopsAPreemptedRunWhenItResumes) {
  SimulatedQuery small(1);
  in_chunk = [&](std::uint32_t chunk) {
    if (other_->status() == Status::pending) world_.engine.cancel(*transaction_);
    if (chunk != 1) return;
    world_.engine.submit(begin_query(*other_, small, soft_terms(1)));
  };
  EXPECT_EQ(world_.execute(begin_query(*transaction_, query_, {}, batch)).status, Status::cancelled);
  EXPECT_EQ(other_->status(), Status::committed);
}

TEST_F(Cancellation, DoesNotChangeAnOutcome) {
  declare(*transaction_);
  world_.execute(*transaction_);
  world_.engine.cancel(*transaction_);
  EXPECT_EQ(transaction_->status(), Status::committed);
  EXPECT_EQ(world_.engine.counts().cancelled, 0u);
}

}  // namespace
}  // namespace rtstdb::transaction::test
