// Who goes first, who is shed, and what closing does.

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <thread>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// An engine held at a gate: what is submitted meanwhile waits, and the order in which it runs is noted.
class Held {
 public:
  explicit Held(std::uint32_t queue_capacity) : world(engine_options(queue_capacity)) {
    world.executor.work = [this](const auto&, std::span<const query::Request> requests, const auto&) {
      const int label = dynamic_cast<SimulatedQuery&>(*requests[0].query).label;
      if (label < 0) {
        gate.pass();
      } else {
        ran.push_back(label);
      }
      world.clock.advance(cost);
      return query::RunReport{};
    };
    hold_again();
  }

  void hold_again() {
    holder_->begin({});
    holder_->add_query(holder_query_, 1);
    world.engine.submit(*holder_);
    gate.wait_until_somebody_stands_there();
  }

  /// Labelled by the order of submission.
  void submit(const Terms& given) {
    queries_.push_back(std::make_unique<SimulatedQuery>(1, static_cast<int>(queries_.size())));
    waiting.push_back(world.make());
    waiting.back()->begin(given);
    waiting.back()->add_query(*queries_.back(), 1);
    world.engine.submit(*waiting.back());
  }

  void let_go() {
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

TEST(Order, ImportanceThenDeadlineThenArrival) {
  Held held(16);
  const ClockTime now = held.world.clock.peek();
  held.submit(terms(DeadlineClass::soft, now + 5ms, 0));         // 0
  held.submit(terms(DeadlineClass::hard, now + 9ms, 0));         // 1: the class gives no precedence
  held.submit(terms(DeadlineClass::soft, now + 8ms, 2));         // 2
  held.submit(terms(DeadlineClass::firm, now + 7ms, 2));         // 3
  held.submit(terms(DeadlineClass::soft, now + 5ms, 0));         // 4: as 0, but later
  held.submit(terms(DeadlineClass::best_effort));                // 5: no deadline
  held.submit(terms(DeadlineClass::best_effort, now + 1ms, 7));  // 6
  held.let_go();
  EXPECT_EQ(held.ran, (std::vector<int>{6, 3, 2, 0, 4, 1, 5}));
}

TEST(Order, AgreesWithASort) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    std::mt19937 random(seed);
    Held held(200);
    const ClockTime now = held.world.clock.peek();
    std::vector<std::tuple<int, ClockTime, int>> expected;
    for (int k = 0; k < 150; ++k) {
      const auto importance = static_cast<std::uint8_t>(random() % 4);
      const ClockTime deadline = now + Nanoseconds(random() % 20);
      held.submit(terms(DeadlineClass::soft, deadline, importance));
      expected.emplace_back(-int{importance}, deadline, k);
    }
    held.let_go();
    std::sort(expected.begin(), expected.end());
    ASSERT_EQ(held.ran.size(), expected.size());
    for (std::size_t k = 0; k < expected.size(); ++k)
      ASSERT_EQ(held.ran[k], std::get<2>(expected[k])) << seed;
  }
}

TEST(Order, AFullQueueShedsTheLeastUrgentBestEffortFirst) {
  Held held(4);
  const ClockTime now = held.world.clock.peek();
  held.submit(terms(DeadlineClass::soft, now + 1ms));            // 0
  held.submit(terms(DeadlineClass::best_effort, now + 2ms, 1));  // 1
  held.submit(terms(DeadlineClass::best_effort, now + 1ms, 0));  // 2: shed for 4
  held.submit(terms(DeadlineClass::soft, now + 9ms));            // 3
  held.submit(terms(DeadlineClass::soft, now + 8ms));            // 4
  held.submit(terms(DeadlineClass::best_effort, now + 9ms, 1));  // 5: the least urgent itself
  held.submit(terms(DeadlineClass::best_effort, now + 1ms, 1));  // 6: takes the place of 1
  held.submit(terms(DeadlineClass::soft, now + 7ms));            // 7: takes the place of 6
  held.submit(terms(DeadlineClass::hard, now + 1us, 7));         // 8: no best effort is left to shed
  held.let_go();
  EXPECT_EQ(held.ran, (std::vector<int>{0, 7, 4, 3}));
  for (const std::size_t shed : {1u, 2u, 5u, 6u, 8u}) {
    EXPECT_EQ(held.waiting[shed]->status(), Status::cancelled) << shed;
    EXPECT_EQ(held.waiting[shed]->outcome().started, ClockTime{}) << shed;
  }
  EXPECT_EQ(held.world.engine.counts().cancelled, 5u);
}

TEST(Order, AdmissionCountsTheWorkThatGoesBefore) {
  Held held(64);
  held.cost = 1ms;
  for (std::uint64_t k = 0; k < scheduler::CostModel::min_samples; ++k)
    held.submit(terms(DeadlineClass::soft));
  held.let_go();
  const std::size_t measured = held.waiting.size();
  held.hold_again();

  const ClockTime now = held.world.clock.peek() + held.cost;  // when the holder lets the others in
  held.submit(terms(DeadlineClass::soft, now + 20ms));
  held.submit(terms(DeadlineClass::soft, now + 4ms));
  held.submit(terms(DeadlineClass::soft, now + 9ms, 3));
  held.submit(terms(DeadlineClass::firm, now + 2500us));  // done at 2 ms, behind the important one
  held.submit(terms(DeadlineClass::firm, now + 2600us));  // done at 3 ms, behind both: refused
  held.let_go();
  const auto status = [&](std::size_t k) { return held.waiting[measured + k]->status(); };
  EXPECT_EQ(status(3), Status::committed);
  EXPECT_EQ(status(4), Status::refused);
  EXPECT_EQ(held.waiting[measured + 3]->outcome().predicted_cost, 1ms);
  // Until 3 ms nothing else comes before it; the work due at 4 ms would. An eighth of it is left to ask
  // again.
  EXPECT_EQ(held.waiting[measured + 4]->outcome().earliest_feasible, now + 3125us);
}

TEST(Order, ClosingCancelsWhatWaitsAndLetsWhatRunsFinish) {
  Held held(4);
  for (int k = 0; k < 6; ++k)
    held.submit(terms(DeadlineClass::hard));
  std::thread closer([&] { held.world.engine.close(); });
  std::this_thread::sleep_for(20ms);
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

TEST(Order, ClosingUnderFireGivesEachItsOneOutcome) {
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
          transaction->remove({63, 1});  // refused: the world stays empty
          status = world.execute(*transaction).status;
          (status == Status::bad_input ? done : cancelled)++;
        } while (status == Status::bad_input);
      });
    }
    std::this_thread::sleep_for(Nanoseconds(round * 50'000));
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
