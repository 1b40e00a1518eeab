// One outcome, whenever a transaction is cancelled.

#include <gtest/gtest.h>

#include <array>
#include <random>
#include <thread>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t batch = 5 * 4096;  // five chunks of what is not measured yet

class Cancelling : public testing::Test {
 protected:
  Cancelling() {
    world_.executor.chunk = [this](const auto&, const auto&, std::uint32_t first, std::uint32_t) {
      world_.clock.advance(500us);
      if (in_chunk) in_chunk(first / 4096);
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

TEST_F(Cancelling, OneThatRunsStopsInItsNextGap) {
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
  EXPECT_EQ(world_.material(entity_), 1);
  in_chunk = nullptr;
  declare(*transaction_);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::committed) << "the next round is another one";
}

TEST_F(Cancelling, OneThatWaitsIsGivenBackWhileAnotherRuns) {
  in_chunk = [&](std::uint32_t chunk) {
    if (chunk != 1) return;
    other_->begin({});
    other_->create(row_of(1));
    other_->remove({63, 1});  // bad input, should it run
    SimulatedQuery asked(1);
    other_->add_query(asked, 1);
    world_.engine.submit(*other_);
    world_.engine.cancel(*other_);
    EXPECT_EQ(world_.engine.wait(*other_).status, Status::cancelled);
  };
  declare(*transaction_);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::committed);
}

TEST_F(Cancelling, OneThatIsInterruptedStopsWhenItsTurnComes) {
  SimulatedQuery small(1);
  in_chunk = [&](std::uint32_t chunk) {
    if (other_->status() == Status::pending) world_.engine.cancel(*transaction_);
    if (chunk != 1) return;
    other_->begin(terms(DeadlineClass::soft, ClockTime::max(), 1));
    other_->add_query(small, 1);
    world_.engine.submit(*other_);
  };
  transaction_->begin({});
  transaction_->add_query(query_, batch);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::cancelled);
  EXPECT_EQ(other_->status(), Status::committed);
}

TEST_F(Cancelling, WhatHasItsOutcomeKeepsIt) {
  declare(*transaction_);
  world_.execute(*transaction_);
  world_.engine.cancel(*transaction_);
  EXPECT_EQ(transaction_->status(), Status::committed);
  EXPECT_EQ(world_.engine.counts().cancelled, 0u);
}

/// Every reading of the clock is a step of the transaction's way: submitted, admitted, started, asked, each
/// gap, computed, published.
TEST_F(Cancelling, AtEveryStepLeavesAllOrNothing) {
  int cancelled = 0;
  int committed = 0;
  for (int step = 1; step <= 16; ++step) {
    declare(*other_);
    world_.clock.call_at_reading(step, [&] { world_.engine.cancel(*other_); });
    const Status status = world_.execute(*other_).status;
    world_.clock.call_at_reading(0, {});
    const std::int64_t material = world_.material(entity_);
    if (status == Status::cancelled) {
      ++cancelled;
      EXPECT_EQ(material, 1) << step;
    } else {
      ++committed;
      ASSERT_EQ(status, Status::committed) << step;
      EXPECT_EQ(material, 2) << step;
      transaction_->begin({});
      transaction_->update(entity_, row_of(1));
      world_.execute(*transaction_);
    }
  }
  EXPECT_GT(cancelled, 4);
  EXPECT_GT(committed, 1) << "or the last steps were not reached";
  EXPECT_EQ(world_.engine.counts().cancelled, static_cast<std::uint64_t>(cancelled));
}

TEST(CancelRace, EachHasItsOneOutcome) {
  World world(engine_options(16, 64, 4096));
  world.executor.chunk = [&](const auto&, const auto&, auto, auto) { world.clock.advance(100us); };
  constexpr int owners = 4;
  constexpr int rounds = 1500;
  std::vector<EntityId> entities;
  std::vector<std::unique_ptr<Transaction>> transactions;
  for (int k = 0; k < owners; ++k) {
    entities.push_back(world.create(0));
    transactions.push_back(world.make());
  }
  std::atomic<bool> done{false};
  std::atomic<std::uint64_t> cancelled{0};
  std::atomic<std::uint64_t> committed{0};
  std::atomic<int> wrong{0};
  const auto own = [&](int k) {
    Transaction& transaction = *transactions[static_cast<std::size_t>(k)];
    const EntityId entity = entities[static_cast<std::size_t>(k)];
    SimulatedQuery query(2 * 4096 + 1);
    const auto reader = world.make();
    std::mt19937 random(static_cast<unsigned>(k));
    std::int64_t material = 0;
    for (int round = 1; round <= rounds; ++round) {
      transaction.begin(
          terms(DeadlineClass::soft, ClockTime::max(), static_cast<std::uint8_t>(random() % 3)));
      transaction.update(entity, row_of(static_cast<std::uint32_t>(round)));
      if (round % 2 == 0) transaction.add_query(query, query.capacity());
      const Status status = world.execute(transaction).status;
      if (status == Status::committed) material = round;
      (status == Status::committed ? committed : cancelled)++;
      wrong += status != Status::committed && status != Status::cancelled;
      reader->begin(terms(DeadlineClass::soft, ClockTime::max(), max_importance));
      reader->read(entity);
      world.execute(*reader);
      wrong += reader->state(0)->row.material != material;
    }
  };
  std::vector<std::thread> threads;
  threads.reserve(owners + 2);
  for (int k = 0; k < owners; ++k)
    threads.emplace_back(own, k);
  std::array<std::thread, 2> cancellers;
  for (unsigned k = 0; k < cancellers.size(); ++k) {
    cancellers[k] = std::thread([&, k] {
      std::mt19937 random(100 + k);
      while (!done) {
        world.engine.cancel(*transactions[random() % owners]);
        std::this_thread::sleep_for(Nanoseconds(random() % 100'000));
      }
    });
  }
  for (std::thread& thread : threads)
    thread.join();
  done = true;
  for (std::thread& thread : cancellers)
    thread.join();
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(cancelled, 100u);
  EXPECT_GT(committed, 100u);
  const TransactionCounts counts = world.engine.counts();
  EXPECT_EQ(counts.cancelled, cancelled);
  EXPECT_EQ(counts.submitted, counts.committed + counts.cancelled);
}

}  // namespace
}  // namespace rtstdb::transaction::test
