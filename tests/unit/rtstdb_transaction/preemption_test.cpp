// What runs at the preemption points between the chunks of a batch, and what it does not change.

#include <gtest/gtest.h>

#include <array>
#include <map>
#include <random>
#include <set>
#include <thread>
#include <tuple>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// Each chunk takes 500 us; `event` is called in the third one of the large batch.
class Preemption : public testing::Test {
 protected:
  Preemption() {
    world_.executor.chunk = [this](const store::RowSource& rows, const query::Request& request,
                                   std::uint32_t first, std::uint32_t) {
      const int label = label_of(request);
      trace_.push_back(label);
      seen_.push_back(mask_in(rows));
      world_.clock.advance(500us);
      if (label == large && event && first == 2 * unmeasured_chunk) event();
    };
  }
  std::int64_t mask_in(const store::RowSource& rows) const {
    const EntityState* state = rows.find(entity_);
    return state != nullptr ? std::int64_t{state->row.mask} : -1;
  }
  const Outcome& run_large(const Terms& given) {
    return world_.execute(begin_query(*large_, large_query_, given, 8 * unmeasured_chunk));
  }

  static constexpr int large = 100;
  World world_;
  EntityId entity_ = world_.create(1);
  std::vector<int> trace_;
  std::vector<std::int64_t> seen_;
  std::function<void()> event;
  SimulatedQuery large_query_{8 * unmeasured_chunk, large};
  SimulatedQuery small_query_{1, 1};
  std::unique_ptr<Transaction> large_ = world_.make();
  std::unique_ptr<Transaction> small_ = world_.make();
};

TEST_F(Preemption, StartsTheHigherPriorityTransactionAfterTheCurrentChunk) {
  event = [&] { world_.engine.submit(begin_query(*small_, small_query_, soft_terms(1))); };
  const Outcome& outcome = run_large(terms(DeadlineClass::soft));
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(trace_, (std::vector<int>{large, large, large, 1, large, large, large, large, large}));
  EXPECT_EQ(small_->outcome().started, small_->outcome().submitted) << "time passes in chunks only";
  EXPECT_EQ(outcome.interrupted, 500us);
  EXPECT_EQ(outcome.actual_cost, 4ms);
  EXPECT_EQ(outcome.published - outcome.started, 4500us);
}

TEST_F(Preemption, CommitsAWriteAndThePreemptedReaderKeepsItsVersion) {
  event = [&] {
    small_->begin(soft_terms(1));
    small_->update(entity_, row_of(2));
    small_->add_query(small_query_, 1);
    world_.engine.submit(*small_);
  };
  const Outcome& outcome = run_large(terms(DeadlineClass::soft));
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(small_->outcome().status, Status::committed);
  EXPECT_LT(outcome.version, small_->outcome().version);
  EXPECT_EQ(seen_, (std::vector<std::int64_t>{1, 1, 1, 2, 1, 1, 1, 1, 1}));
  EXPECT_EQ(world_.mask(entity_), 2);
}

TEST_F(Preemption, OfAWriterIsByReadersOnly) {
  const auto writer = world_.make();
  event = [&] {
    writer->begin(soft_terms(2));
    writer->update(entity_, row_of(7));
    world_.engine.submit(*writer);
    world_.engine.submit(begin_query(*small_, small_query_, soft_terms(1)));
  };
  large_->begin({});
  large_->update(entity_, row_of(5));
  large_->add_query(large_query_, 8 * unmeasured_chunk);
  EXPECT_EQ(world_.execute(*large_).status, Status::committed);
  EXPECT_EQ(world_.engine.wait(*writer).status, Status::committed);
  EXPECT_EQ(seen_, (std::vector<std::int64_t>{5, 5, 5, 1, 5, 5, 5, 5, 5}))
      << "only the writer sees what it staged";
  EXPECT_LT(small_->outcome().version, large_->outcome().version);
  EXPECT_EQ(writer->outcome().version, large_->outcome().version + 1);
}

TEST_F(Preemption, StopsAFirmTransactionAfterItsDeadline) {
  const Outcome& outcome = run_large(terms(DeadlineClass::firm, world_.clock.peek() + 1700us));
  EXPECT_EQ(outcome.status, Status::missed);
  EXPECT_EQ(trace_.size(), 4u) << "the first preemption point after the deadline is at 2 ms";
  EXPECT_EQ(outcome.lateness, 300us);
}

TEST_F(Preemption, IsNotNeededToMissAPassedDeadline) {
  event = [&] {
    begin_query(*small_, small_query_, terms(DeadlineClass::firm, world_.clock.peek() - 1ns, 7));
    EXPECT_EQ(world_.execute(*small_).status, Status::missed) << "by the write helper thread";
  };
  EXPECT_EQ(run_large(terms(DeadlineClass::soft)).status, Status::committed);
  EXPECT_EQ(trace_.size(), 8u);
}

TEST_F(Preemption, OfMeasuredBatchesIsPossibleEveryHalfMillisecond) {
  std::set<std::uint32_t> steps;
  world_.executor.chunk = [&](const auto&, const query::Request& request, std::uint32_t first,
                              std::uint32_t end) {
    if (end != request.count) steps.insert(end - first);
    world_.clock.advance(Nanoseconds(100) * (end - first));
  };
  for (int k = 0; k < 3; ++k) {
    steps.clear();
    run_large(terms(DeadlineClass::soft));
  }
  ASSERT_EQ(steps.size(), 1u);
  EXPECT_NEAR(*steps.begin(), 5000.0, 5.0);
}

TEST_F(Preemption, DoesNotOccurUnderAVirtualClock) {
  world_.clock.virtual_time = true;
  run_large(terms(DeadlineClass::soft));
  EXPECT_EQ(trace_.size(), 1u);
}

TEST(PreemptionWithShortHistory, DelaysACommitThatWouldDropThePreemptedReadersVersion) {
  World world(engine_options(64, 64, 1));
  const EntityId first = world.create(1);
  SimulatedQuery large(3 * unmeasured_chunk, 0);
  SimulatedQuery small(1, 1);
  const auto reader = world.make();
  const auto fits = world.make();
  const auto too_much = world.make();
  std::vector<std::uint32_t> seen;
  world.executor.chunk = [&](const store::RowSource& rows, const query::Request& request, std::uint32_t begin,
                             std::uint32_t) {
    if (request.query != &large) return;
    seen.push_back(rows.find(first)->row.mask);
    if (begin != 0) return;
    too_much->begin(soft_terms(1));
    too_much->update(first, row_of(2));
    too_much->create(row_of(3));  // two changes; the history holds one
    too_much->add_query(small, 1);
    world.engine.submit(*too_much);
    fits->begin(soft_terms(1));
    fits->update(first, row_of(4));
    world.engine.submit(*fits);
  };
  EXPECT_EQ(world.execute(begin_query(*reader, large, {}, 3 * unmeasured_chunk)).status, Status::committed);
  EXPECT_EQ(world.engine.wait(*too_much).status, Status::committed);
  EXPECT_EQ(seen, (std::vector<std::uint32_t>{1, 1, 1}));
  EXPECT_LE(fits->outcome().published, reader->outcome().computed);
  EXPECT_GT(too_much->outcome().version, fits->outcome().version);
  EXPECT_EQ(world.mask(first), 2);
}

/// Transactions submit further ones in their chunks, at random. A model says which transaction each chunk has
/// to belong to.
class RandomPreemptions {
 public:
  explicit RandomPreemptions(unsigned seed) : random_(seed) {
    world_.executor.chunk = [this](const store::RowSource&, const query::Request& request,
                                   std::uint32_t first, std::uint32_t end) {
      world_.clock.advance(Nanoseconds(125) * (end - first));
      chunk(label_of(request), first == 0, end == request.count);
    };
    for (std::size_t k = 0; k < count; ++k) {
      queries_.push_back(std::make_unique<SimulatedQuery>(5 * unmeasured_chunk, static_cast<int>(k)));
      transactions_.push_back(world_.make());
    }
  }

  void run() {
    world_.engine.call([&] { submit_some(3); });
    for (std::size_t k = 0; k < count; ++k) {
      // Other transactions submit it later.
      while (transactions_[k]->status() == Status::idle)
        std::this_thread::yield();
      ASSERT_EQ(world_.engine.wait(*transactions_[k]).status, Status::committed);
    }
    EXPECT_EQ(errors_, 0);
    EXPECT_TRUE(stack_.empty());
  }
  std::size_t deepest() const { return deepest_; }

  static constexpr std::size_t count = 40;

 private:
  using Priority = std::tuple<int, std::int64_t, std::size_t>;

  void chunk(int label, bool begins, bool ends) {
    const auto self = static_cast<std::size_t>(label);
    const bool deep = stack_.size() > query::max_nesting;
    if (begins) {
      errors_ += waiting_.empty() || waiting_.begin()->second != self;
      errors_ += deep || (!stack_.empty() && priority_[stack_.back()] < priority_[self]);
      waiting_.erase(priority_[self]);
      stack_.push_back(self);
    } else {
      errors_ += stack_.back() != self;
      errors_ += !deep && !waiting_.empty() && waiting_.begin()->first < priority_[self];
    }
    deepest_ = std::max(deepest_, stack_.size());
    submit_some(random_() % 3);
    if (ends) stack_.pop_back();
    // No further chunk submits anything once everything is done.
    if (stack_.empty() && waiting_.empty()) submit_some(1);
  }

  void submit_some(std::size_t transactions) {
    for (; transactions > 0 && next_ < count; --transactions, ++next_) {
      // Every second one preempts all others, so that runs nest deeply.
      const std::size_t level = random_() % 2 == 0 ? stack_.size() : random_() % 8;
      const auto importance = static_cast<std::uint8_t>(std::min<std::size_t>(level, max_importance));
      const std::int64_t deadline_ns = 1'000'000'000'000 + static_cast<std::int64_t>(random_() % 5);
      priority_[next_] = {-int{importance}, deadline_ns, next_};
      waiting_[priority_[next_]] = next_;
      transactions_[next_]->begin(terms(DeadlineClass::soft, clock_time_ns(deadline_ns), importance));
      const std::uint32_t chunks = 1 + static_cast<std::uint32_t>(random_() % 5);
      transactions_[next_]->add_query(*queries_[next_], chunks * unmeasured_chunk);
      world_.engine.submit(*transactions_[next_]);
    }
  }

  std::mt19937 random_;
  std::vector<std::unique_ptr<SimulatedQuery>> queries_;
  std::vector<std::size_t> stack_;
  std::map<Priority, std::size_t> waiting_;
  std::array<Priority, count> priority_{};
  std::size_t next_ = 0;
  std::size_t deepest_ = 0;
  int errors_ = 0;
  World world_{engine_options(count)};
  std::vector<std::unique_ptr<Transaction>> transactions_;
};

TEST(RandomPreemption, RunsTheHighestPriorityAtEachPreemptionPoint) {
  std::size_t deepest = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    RandomPreemptions world(seed);
    world.run();
    deepest = std::max(deepest, world.deepest());
  }
  EXPECT_EQ(deepest, query::max_nesting + 1u);
}

}  // namespace
}  // namespace rtstdb::transaction::test
