// Which answers a query has after a transaction that was not done in time.

#include <gtest/gtest.h>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// Each chunk of 4096 elements takes 500 us.
class LatePolicies : public testing::Test {
 protected:
  static constexpr std::uint32_t batch = 8 * unmeasured_chunk;

  LatePolicies() {
    world_.executor.chunk = [this](const auto&, const query::Request&, std::uint32_t first,
                                   std::uint32_t end) {
      ++chunks_;
      world_.clock.advance(500us * (end - first) / unmeasured_chunk);
      if (after_chunk) after_chunk();
    };
  }
  static std::uint32_t hits(const SimulatedQuery& query) {
    return static_cast<std::uint32_t>(
        std::ranges::count(query.hits(), HitStatus::hit, [](const RayHit& hit) { return hit.status; }));
  }
  const Outcome& run(const Terms& given, std::initializer_list<SimulatedQuery*> queries) {
    world_.executor.lambda += 1.0f;
    transaction_->begin(given);
    for (SimulatedQuery* query : queries)
      transaction_->add_query(*query, batch);
    return world_.execute(*transaction_);
  }
  Terms firm(Nanoseconds deadline) const {
    return terms(DeadlineClass::firm, world_.clock.peek() + deadline);
  }

  World world_;
  EntityId entity_ = world_.create(1);
  int chunks_ = 0;
  std::function<void()> after_chunk;
  SimulatedQuery discard_{batch, 0};
  SimulatedQuery last_good_{batch, 1, query::CostClass::ray_any, LatePolicy::last_good};
  SimulatedQuery partial_{batch, 2, query::CostClass::ray_first, LatePolicy::partial};
  std::unique_ptr<Transaction> transaction_ = world_.make(2, 4);
};

TEST_F(LatePolicies, DiscardLeavesNoAnswers) {
  run({}, {&discard_});
  EXPECT_EQ(hits(discard_), batch);
  EXPECT_EQ(discard_.answer_info().elements, batch);
  EXPECT_EQ(discard_.answer_info().version, 1u);
  EXPECT_EQ(run(firm(1700us), {&discard_}).status, Status::missed);
  EXPECT_EQ(discard_.hits().size(), 0u);
  EXPECT_EQ(discard_.answer_info().elements, 0u);
  EXPECT_FALSE(transaction_->outcome().stale || transaction_->outcome().partial);
}

TEST_F(LatePolicies, SoftTransactionsAreLateWithAllAnswers) {
  const Outcome& outcome =
      run(terms(DeadlineClass::soft, world_.clock.peek() + 1700us), {&discard_, &last_good_});
  EXPECT_EQ(outcome.status, Status::late);
  EXPECT_EQ(hits(discard_), batch);
  EXPECT_EQ(hits(last_good_), batch);
  EXPECT_FALSE(last_good_.answer_info().stale);
}

TEST_F(LatePolicies, LastGoodKeepsAnswersAndTheirAge) {
  EXPECT_EQ(run(firm(1700us), {&last_good_}).status, Status::missed);
  EXPECT_FALSE(transaction_->outcome().stale) << "there is no earlier answer";
  EXPECT_EQ(last_good_.hits().size(), 0u);

  const ClockTime published = run({}, {&last_good_}).published;
  EXPECT_EQ(last_good_.hits()[5].lambda, 2.0f);
  world_.create(2);
  world_.clock.advance(10ms);
  for (int round = 1; round <= 2; ++round) {
    const Outcome& outcome = run(firm(1700us), {&last_good_});
    EXPECT_EQ(outcome.status, Status::missed);
    EXPECT_TRUE(outcome.stale);
    EXPECT_EQ(last_good_.hits().size(), batch);
    EXPECT_EQ(last_good_.hits()[5].lambda, 2.0f) << "of the committed transaction";
    const AnswerInfo& info = last_good_.answer_info();
    EXPECT_TRUE(info.stale);
    EXPECT_EQ(info.version, 1u);
    EXPECT_EQ(info.published, published);
    EXPECT_EQ(info.age, 10ms + round * 2ms) << "a miss ends at the preemption point after 2 ms";
    EXPECT_EQ(describe(outcome),
              "missed: the firm deadline had passed by 0.300 ms; nothing was done; earlier answers remain");
  }
  run({}, {&last_good_});
  EXPECT_FALSE(transaction_->outcome().stale);
  EXPECT_EQ(last_good_.answer_info().version, 2u);
  EXPECT_EQ(last_good_.hits()[5].lambda, 5.0f);
}

TEST_F(LatePolicies, LastGoodKeepsAnswersForEveryStatus) {
  run({}, {&last_good_});
  const auto expect_stale = [&](Status status) {
    EXPECT_EQ(transaction_->status(), status);
    EXPECT_TRUE(transaction_->outcome().stale);
    EXPECT_EQ(last_good_.hits()[7].lambda, 1.0f);
  };
  transaction_->begin({});
  transaction_->expect_exists({9, 9});
  transaction_->add_query(last_good_, batch);
  world_.execute(*transaction_);
  expect_stale(Status::conflict);
  last_good_.rays()[3].t = world_time_ns(-1);
  run({}, {&last_good_});
  expect_stale(Status::bad_input);
  last_good_.rays()[3].t = {};
  after_chunk = [&] { world_.engine.cancel(*transaction_); };
  run({}, {&last_good_});
  after_chunk = nullptr;
  expect_stale(Status::cancelled);
  run(firm(-1ns), {&last_good_});
  expect_stale(Status::missed);
  world_.engine.close();
  run({}, {&last_good_});
  expect_stale(Status::cancelled);
}

TEST_F(LatePolicies, PartialEndsInTimeWithTheAnswersSoFar) {
  // Chunks end after 500, 1000, ... us. After 1500 us another one passes the deadline.
  for (const DeadlineClass deadline_class : {DeadlineClass::firm, DeadlineClass::soft, DeadlineClass::hard}) {
    chunks_ = 0;
    const Outcome& outcome = run(terms(deadline_class, world_.clock.peek() + 1700us), {&partial_});
    EXPECT_EQ(outcome.status, Status::truncated);
    EXPECT_TRUE(outcome.partial);
    EXPECT_NEAR(static_cast<double>((outcome.published - outcome.started).count()), 1.5e6, 5e3);
    EXPECT_EQ(chunks_, 3);
    EXPECT_EQ(partial_.hits().size(), batch);
    EXPECT_NEAR(hits(partial_), 3 * unmeasured_chunk, 8) << "chunk sizes follow the measured cost";
    EXPECT_EQ(partial_.hits()[batch - 1].status, HitStatus::incomplete);
    EXPECT_EQ(partial_.answer_info().missing, batch - hits(partial_));
    EXPECT_EQ(partial_.answer_info().version, 1u);
    EXPECT_EQ(partial_.answer_info().published, outcome.published);
  }
  EXPECT_EQ(run(firm(10ms), {&partial_}).status, Status::committed);
  EXPECT_EQ(partial_.answer_info().missing, 0u);
}

TEST_F(LatePolicies, PartialIsAdmittedIfOneChunkIsInTime) {
  for (std::uint32_t k = 0; k < 40; ++k)
    run({}, {&discard_, &partial_});
  EXPECT_EQ(run(firm(2ms), {&discard_}).status, Status::refused);
  const Outcome& outcome = run(firm(2ms), {&partial_});
  EXPECT_EQ(outcome.status, Status::truncated);
  EXPECT_NEAR(static_cast<double>(outcome.predicted_cost.count()), 4e6, 4e4)
      << "predicted for the whole batch";
  EXPECT_EQ(run(firm(500us), {&partial_}).status, Status::refused) << "less than a chunk";
  EXPECT_EQ(run(firm(4500us), {&discard_, &partial_}).status, Status::refused);
  EXPECT_EQ(run(firm(5500us), {&discard_, &partial_}).status, Status::truncated)
      << "the other query and one chunk";
  EXPECT_EQ(hits(discard_), batch);
}

TEST_F(LatePolicies, PartialThatIsMissedKeepsTheAnswersThatWereInTime) {
  // The third chunk takes longer than predicted.
  after_chunk = [&] {
    if (chunks_ == 3) world_.clock.advance(5ms);
  };
  const Outcome& outcome = run(firm(1700us), {&partial_});
  EXPECT_EQ(outcome.status, Status::missed) << "a firm transaction is never late";
  EXPECT_TRUE(outcome.partial);
  EXPECT_EQ(hits(partial_), 2 * unmeasured_chunk);
  EXPECT_EQ(partial_.answer_info().missing, batch - 2 * unmeasured_chunk);
  EXPECT_EQ(partial_.answer_info().version, 1u);
  EXPECT_EQ(partial_.answer_info().published, ClockTime{});
  EXPECT_NE(describe(outcome).find("but some elements were answered by then"), std::string::npos);
  run(firm(-1ns), {&partial_});
  EXPECT_FALSE(transaction_->outcome().partial) << "nothing of an earlier run";
  EXPECT_EQ(partial_.hits().size(), 0u);
}

TEST_F(LatePolicies, PartialEndsEarlyOnlyAfterTheOtherQueries) {
  // Each query takes 4 ms: both are done within 6 ms only if the partial one ends early.
  EXPECT_EQ(run(firm(6ms), {&discard_, &partial_}).status, Status::truncated);
  EXPECT_EQ(hits(discard_), batch);
  EXPECT_EQ(hits(partial_), 4 * unmeasured_chunk);
  EXPECT_EQ(run(firm(6ms), {&partial_, &discard_}).status, Status::missed);
  EXPECT_EQ(hits(partial_), batch) << "it is complete before the deadline";
  EXPECT_EQ(partial_.answer_info().missing, 0u);
  EXPECT_EQ(discard_.hits().size(), 0u);
  run({}, {&last_good_});
  EXPECT_EQ(run(firm(6ms), {&partial_, &last_good_, &discard_}).status, Status::missed);
  EXPECT_TRUE(transaction_->outcome().stale);
  EXPECT_TRUE(transaction_->outcome().partial);
  EXPECT_TRUE(last_good_.answer_info().stale);
  EXPECT_FALSE(partial_.answer_info().stale);
  EXPECT_EQ(run(terms(DeadlineClass::soft, world_.clock.peek() + 1ms), {&partial_, &discard_}).status,
            Status::late)
      << "a soft transaction completes the other query";
  EXPECT_EQ(hits(partial_), batch);
}

TEST_F(LatePolicies, PartialAnswersOfAMissedWriteAreDiscarded) {
  transaction_->begin(firm(1700us));
  transaction_->update(entity_, row_of(7));
  transaction_->add_query(partial_, batch);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::missed);
  EXPECT_FALSE(transaction_->outcome().partial);
  EXPECT_EQ(partial_.hits().size(), 0u) << "their version was not published";
  transaction_->begin(terms(DeadlineClass::soft, world_.clock.peek() + 1700us));
  transaction_->update(entity_, row_of(7));
  transaction_->add_query(partial_, batch);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::late);
  EXPECT_EQ(hits(partial_), batch);
}

TEST_F(LatePolicies, PartialThatIsCancelledLeavesNoAnswers) {
  after_chunk = [&] {
    if (chunks_ == 3) world_.engine.cancel(*transaction_);
  };
  EXPECT_EQ(run(firm(10ms), {&partial_}).status, Status::cancelled);
  EXPECT_EQ(partial_.hits().size(), 0u);
}

TEST_F(LatePolicies, PreemptionTimeDoesNotCountForAChunk) {
  const auto higher = world_.make();
  SimulatedQuery higher_query(2 * unmeasured_chunk, 9);
  after_chunk = [&] {
    if (chunks_ != 1) return;
    world_.engine.submit(begin_query(*higher, higher_query, terms(DeadlineClass::hard, ClockTime::max(), 7),
                                     2 * unmeasured_chunk));
  };
  run(firm(3200us), {&partial_});
  EXPECT_EQ(hits(partial_), 4 * unmeasured_chunk) << "at 0.5, 2, 2.5 and 3 ms";
}

}  // namespace
}  // namespace rtstdb::transaction::test
