// The order of execution, the full queue, and closing.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <thread>

#include "tests/support/eventually.hpp"
#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// An engine that is held at a gate while transactions are submitted; notes the order in which they run.
class HeldEngine {
 public:
  explicit HeldEngine(std::uint32_t queue_capacity) : world(engine_options(queue_capacity)) {
    world.executor.work = [this](const auto&, std::span<const query::Request> requests, const auto&) {
      const int label = label_of(requests[0]);
      if (label < 0) {
        gate.pass();
      } else {
        ran.push_back(label);
      }
      world.clock.advance(cost);
      return query::RunReport{};
    };
    hold();
  }

  void hold() {
    world.engine.submit(begin_query(*holder_, holder_query_, {}));
    gate.wait_until_held();
  }

  /// Labelled by the order of submission.
  void submit(const Terms& given) {
    queries_.push_back(std::make_unique<SimulatedQuery>(1, static_cast<int>(queries_.size())));
    waiting.push_back(world.make());
    world.engine.submit(begin_query(*waiting.back(), *queries_.back(), given));
  }

  void release() {
    gate.open();
    world.engine.wait(*holder_);
    for (const auto& transaction : waiting)
      world.engine.wait(*transaction);
  }

  Gate gate;
  World world;
  Nanoseconds cost{0};
  std::vector<int> ran;
  std::vector<std::unique_ptr<Transaction>> waiting;

 private:
  SimulatedQuery holder_query_{1, -1};
  std::vector<std::unique_ptr<SimulatedQuery>> queries_;
  std::unique_ptr<Transaction> holder_ = world.make();
};

TEST(Order, IsByImportanceThenDeadlineThenArrival) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    HeldEngine held(200);
    const ClockTime now = held.world.clock.peek();
    std::vector<std::tuple<int, ClockTime, int>> expected;
    for (int k = 0; k < 150; ++k) {
      const auto importance = static_cast<std::uint8_t>(random() % 4);
      const ClockTime deadline = random() % 8 == 0 ? ClockTime::max() : now + Nanoseconds(random() % 20);
      // The deadline class gives no precedence. One in eight has no deadline.
      held.submit(terms(static_cast<DeadlineClass>(random() % 4), deadline, importance));
      expected.emplace_back(-int{importance}, deadline, k);
    }
    held.release();
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(held.ran.size(), expected.size());
    for (std::size_t k = 0; k < expected.size(); ++k)
      ASSERT_EQ(held.ran[k], std::get<2>(expected[k])) << seed;
  }
}

TEST(Order, AFullQueueCancelsTheBestEffortTransactionOfLowestPriority) {
  HeldEngine held(4);
  const ClockTime now = held.world.clock.peek();
  held.submit(terms(DeadlineClass::soft, now + 1ms));            // 0
  held.submit(terms(DeadlineClass::best_effort, now + 2ms, 1));  // 1
  held.submit(terms(DeadlineClass::best_effort, now + 1ms, 0));  // 2: cancelled for 4
  held.submit(terms(DeadlineClass::soft, now + 9ms));            // 3
  held.submit(terms(DeadlineClass::soft, now + 8ms));            // 4
  held.submit(terms(DeadlineClass::best_effort, now + 9ms, 1));  // 5: has the lowest priority itself
  held.submit(terms(DeadlineClass::best_effort, now + 1ms, 1));  // 6: takes the place of 1
  held.submit(terms(DeadlineClass::soft, now + 7ms));            // 7: takes the place of 6
  held.submit(terms(DeadlineClass::hard, now + 1us, 7));         // 8: no best effort is left
  held.release();
  EXPECT_EQ(held.ran, (std::vector<int>{0, 7, 4, 3}));
  for (const std::size_t cancelled : {1u, 2u, 5u, 6u, 8u}) {
    EXPECT_EQ(held.waiting[cancelled]->status(), Status::cancelled) << cancelled;
    EXPECT_EQ(held.waiting[cancelled]->outcome().started, ClockTime{}) << cancelled;
  }
  EXPECT_EQ(held.world.engine.counts().cancelled, 5u);
}

TEST(Order, AdmissionCountsHigherPriorityWork) {
  HeldEngine held(64);
  held.cost = 1ms;
  for (std::uint64_t k = 0; k < scheduler::CostModel::min_samples; ++k)
    held.submit(terms(DeadlineClass::soft));
  held.release();
  const std::size_t measured = held.waiting.size();
  held.hold();

  const ClockTime now = held.world.clock.peek() + held.cost;  // when the holder ends
  held.submit(terms(DeadlineClass::soft, now + 20ms));
  held.submit(terms(DeadlineClass::soft, now + 4ms));
  held.submit(terms(DeadlineClass::soft, now + 9ms, 3));
  held.submit(terms(DeadlineClass::firm, now + 2500us));  // done at 2 ms, after the important one
  held.submit(terms(DeadlineClass::firm, now + 2600us));  // done at 3 ms, after both: refused
  held.release();
  const auto status = [&](std::size_t k) { return held.waiting[measured + k]->status(); };
  EXPECT_EQ(status(3), Status::committed);
  EXPECT_EQ(status(4), Status::refused);
  EXPECT_EQ(held.waiting[measured + 3]->outcome().predicted_cost, 1ms);
  // At 3 ms it is done before the work that is due at 4 ms. An eighth of its cost is added for the
  // resubmission.
  EXPECT_EQ(held.waiting[measured + 4]->outcome().earliest_feasible, now + 3125us);
}

TEST(Order, ClosingCancelsWaitingTransactionsAndCompletesTheRunningOne) {
  HeldEngine held(4);
  for (int k = 0; k < 6; ++k)
    held.submit(terms(DeadlineClass::hard));
  std::thread closer([&] { held.world.engine.close(); });
  EXPECT_TRUE(hil::tests::eventually([&] { return held.world.engine.is_closing(); }));
  held.gate.open();
  closer.join();
  for (const auto& transaction : held.waiting)
    EXPECT_EQ(transaction->status(), Status::cancelled);
  EXPECT_TRUE(held.ran.empty());

  const auto after = held.world.make();
  after->begin({});
  after->create(row_of(1));
  EXPECT_EQ(held.world.execute(*after).status, Status::cancelled);
  const TransactionCounts counts = held.world.engine.counts();
  EXPECT_EQ(counts.submitted, 8u);
  EXPECT_EQ(counts.committed, 1u);
  EXPECT_EQ(counts.cancelled, 7u);
}

TEST(Order, ClosingDuringSubmissionsGivesEachOneOutcome) {
  for (int round = 0; round < 30; ++round) {
    World world(engine_options(8));
    std::atomic<std::uint64_t> done{0};
    std::atomic<std::uint64_t> cancelled{0};
    std::vector<std::thread> threads;
    threads.reserve(4);
    for (int k = 0; k < 4; ++k) {
      threads.emplace_back([&] {
        const auto transaction = world.make();
        Status status = Status::idle;
        do {
          transaction->begin({});
          transaction->create(row_of(1));
          transaction->remove({63, 1});  // bad input: the world stays empty
          status = world.execute(*transaction).status;
          (status == Status::bad_input ? done : cancelled)++;
        } while (status == Status::bad_input);
      });
    }
    const auto before_close = static_cast<std::uint64_t>(round) * 40;
    EXPECT_TRUE(hil::tests::eventually([&] { return world.engine.counts().submitted >= before_close; }));
    world.engine.close();
    for (std::thread& thread : threads)
      thread.join();
    const TransactionCounts counts = world.engine.counts();
    EXPECT_EQ(counts.submitted, done + cancelled);
    EXPECT_EQ(counts.bad_input, done);
    EXPECT_EQ(counts.cancelled, 4u);
  }
}

}  // namespace
}  // namespace rtstdb::transaction::test
