// What is left of the answers of a transaction that is not done in time.

#include <gtest/gtest.h>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

constexpr std::uint32_t batch = 8 * unmeasured_chunk;

/// Each chunk of 4096 elements takes 500 us.
class Late : public testing::Test {
 protected:
  Late() {
    world_.executor.chunk = [this](const auto&, const query::Request& request, std::uint32_t first,
                                   std::uint32_t end) {
      asked_.push_back(dynamic_cast<SimulatedQuery&>(*request.query).label);
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
  std::vector<int> asked_;
  std::function<void()> after_chunk;
  SimulatedQuery discard_{batch, 0};
  SimulatedQuery last_good_{batch, 1, query::CostClass::ray_any, LatePolicy::last_good};
  SimulatedQuery partial_{batch, 2, query::CostClass::ray_first, LatePolicy::partial};
  std::unique_ptr<Transaction> transaction_ = world_.make(2, 4);
};

TEST_F(Late, DiscardLeavesNothing) {
  run({}, {&discard_});
  EXPECT_EQ(hits(discard_), batch);
  EXPECT_EQ(discard_.answer_info().elements, batch);
  EXPECT_EQ(discard_.answer_info().version, 1u);
  EXPECT_EQ(run(firm(1700us), {&discard_}).status, Status::missed);
  EXPECT_EQ(discard_.hits().size(), 0u);
  EXPECT_EQ(discard_.answer_info().elements, 0u);
  EXPECT_FALSE(transaction_->outcome().stale || transaction_->outcome().partial);
}

TEST_F(Late, SoftOnesAreLateWithAllAnswers) {
  const Outcome& outcome =
      run(terms(DeadlineClass::soft, world_.clock.peek() + 1700us), {&discard_, &last_good_});
  EXPECT_EQ(outcome.status, Status::late);
  EXPECT_EQ(hits(discard_), batch);
  EXPECT_EQ(hits(last_good_), batch);
  EXPECT_FALSE(last_good_.answer_info().stale);
}

TEST_F(Late, LastGoodStaysAndSaysHowOldItIs) {
  EXPECT_EQ(run(firm(1700us), {&last_good_}).status, Status::missed);
  EXPECT_FALSE(transaction_->outcome().stale) << "there is none";
  EXPECT_EQ(last_good_.hits().size(), 0u);

  const ClockTime published = run({}, {&last_good_}).published;
  EXPECT_EQ(last_good_.hits()[5].lambda, 2.0f);
  world_.create(2);
  world_.clock.advance(10ms);
  for (int again = 1; again <= 2; ++again) {
    const Outcome& outcome = run(firm(1700us), {&last_good_});
    EXPECT_EQ(outcome.status, Status::missed);
    EXPECT_TRUE(outcome.stale);
    EXPECT_EQ(last_good_.hits().size(), batch);
    EXPECT_EQ(last_good_.hits()[5].lambda, 2.0f) << "of the one that was done";
    const AnswerInfo& info = last_good_.answer_info();
    EXPECT_TRUE(info.stale);
    EXPECT_EQ(info.version, 1u);
    EXPECT_EQ(info.published, published);
    EXPECT_EQ(info.age, 10ms + again * 2ms) << "a miss is seen in the gap after 2 ms";
    EXPECT_EQ(describe(outcome),
              "missed: the firm deadline had passed by 0.300 ms; nothing was done; earlier answers remain");
  }
  run({}, {&last_good_});
  EXPECT_FALSE(transaction_->outcome().stale);
  EXPECT_EQ(last_good_.answer_info().version, 2u);
  EXPECT_EQ(last_good_.hits()[5].lambda, 5.0f);
}

TEST_F(Late, LastGoodStaysWhateverTheReason) {
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

TEST_F(Late, PartialEndsInTimeWithWhatThereIs) {
  // Chunks are through after 500, 1000, ... us. After 1500 another one would pass the deadline.
  for (const DeadlineClass kind : {DeadlineClass::firm, DeadlineClass::soft, DeadlineClass::hard}) {
    asked_.clear();
    const Outcome& outcome = run(terms(kind, world_.clock.peek() + 1700us), {&partial_});
    EXPECT_EQ(outcome.status, Status::truncated);
    EXPECT_TRUE(outcome.partial);
    EXPECT_NEAR(static_cast<double>((outcome.published - outcome.started).count()), 1.5e6, 5e3);
    EXPECT_EQ(asked_.size(), 3u);
    EXPECT_EQ(partial_.hits().size(), batch);
    EXPECT_NEAR(hits(partial_), 3 * unmeasured_chunk, 8) << "as divided by what is known by then";
    EXPECT_EQ(partial_.hits()[batch - 1].status, HitStatus::incomplete);
    EXPECT_EQ(partial_.answer_info().missing, batch - hits(partial_));
    EXPECT_EQ(partial_.answer_info().version, 1u);
    EXPECT_EQ(partial_.answer_info().published, outcome.published);
  }
  EXPECT_EQ(run(firm(10ms), {&partial_}).status, Status::committed);
  EXPECT_EQ(partial_.answer_info().missing, 0u);
}

TEST_F(Late, PartialIsAdmittedThoughAllOfItTakesLonger) {
  for (std::uint32_t k = 0; k < 40; ++k)
    run({}, {&discard_, &partial_});
  EXPECT_EQ(run(firm(2ms), {&discard_}).status, Status::refused);
  const Outcome& outcome = run(firm(2ms), {&partial_});
  EXPECT_EQ(outcome.status, Status::truncated);
  EXPECT_NEAR(static_cast<double>(outcome.predicted_cost.count()), 4e6, 4e4)
      << "of all of it, as little as was answered";
  EXPECT_EQ(run(firm(500us), {&partial_}).status, Status::refused) << "not even a chunk";
  EXPECT_EQ(run(firm(4500us), {&discard_, &partial_}).status, Status::refused);
  EXPECT_EQ(run(firm(5500us), {&discard_, &partial_}).status, Status::truncated)
      << "what is needed, and a chunk";
  EXPECT_EQ(hits(discard_), batch);
}

TEST_F(Late, PartialThatIsLateAllTheSameIsMissedWithWhatWasInTime) {
  // The third chunk takes longer than could be foreseen.
  after_chunk = [&] {
    if (asked_.size() == 3) world_.clock.advance(5ms);
  };
  const Outcome& outcome = run(firm(1700us), {&partial_});
  EXPECT_EQ(outcome.status, Status::missed) << "a firm one is never late";
  EXPECT_TRUE(outcome.partial);
  EXPECT_EQ(hits(partial_), 2 * unmeasured_chunk);
  EXPECT_EQ(partial_.answer_info().missing, batch - 2 * unmeasured_chunk);
  EXPECT_EQ(partial_.answer_info().version, 1u);
  EXPECT_EQ(partial_.answer_info().published, ClockTime{});
  EXPECT_NE(describe(outcome).find("but some elements were answered by then"), std::string::npos);
  run(firm(-1ns), {&partial_});
  EXPECT_FALSE(transaction_->outcome().partial) << "nothing of a run before";
  EXPECT_EQ(partial_.hits().size(), 0u);
}

TEST_F(Late, OthersHaveToBeDoneBeforePartialOnesEnd) {
  // 4 ms for the first: a firm one can not be done within 6 unless what is partial ends.
  EXPECT_EQ(run(firm(6ms), {&discard_, &partial_}).status, Status::truncated);
  EXPECT_EQ(hits(discard_), batch);
  EXPECT_EQ(hits(partial_), 4 * unmeasured_chunk);
  EXPECT_EQ(run(firm(6ms), {&partial_, &discard_}).status, Status::missed);
  EXPECT_EQ(hits(partial_), batch) << "its part was done by then";
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
      << "a soft one goes on for the others";
  EXPECT_EQ(hits(partial_), batch);
}

TEST_F(Late, WritesLeaveNoPartialAnswers) {
  transaction_->begin(firm(1700us));
  transaction_->update(entity_, row_of(7));
  transaction_->add_query(partial_, batch);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::missed);
  EXPECT_FALSE(transaction_->outcome().partial);
  EXPECT_EQ(partial_.hits().size(), 0u) << "they were about a version that never was";
  transaction_->begin(terms(DeadlineClass::soft, world_.clock.peek() + 1700us));
  transaction_->update(entity_, row_of(7));
  transaction_->add_query(partial_, batch);
  EXPECT_EQ(world_.execute(*transaction_).status, Status::late);
  EXPECT_EQ(hits(partial_), batch);
}

TEST_F(Late, PartialThatIsCancelledLeavesNothing) {
  after_chunk = [&] {
    if (asked_.size() == 3) world_.engine.cancel(*transaction_);
  };
  EXPECT_EQ(run(firm(10ms), {&partial_}).status, Status::cancelled);
  EXPECT_EQ(partial_.hits().size(), 0u);
}

TEST_F(Late, TimeSpentOnOthersIsNotAChunks) {
  const auto urgent = world_.make();
  SimulatedQuery urgent_query(2 * unmeasured_chunk, 9);
  after_chunk = [&] {
    if (asked_.size() != 1) return;
    urgent->begin(terms(DeadlineClass::hard, ClockTime::max(), 7));
    urgent->add_query(urgent_query, 2 * unmeasured_chunk);
    world_.engine.submit(*urgent);
  };
  run(firm(3200us), {&partial_});
  EXPECT_EQ(hits(partial_), 4 * unmeasured_chunk) << "at 0.5, 2, 2.5 and 3 ms";
}

}  // namespace
}  // namespace rtstdb::transaction::test
