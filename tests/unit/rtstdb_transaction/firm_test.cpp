// Firm means: readable before its deadline, or never.

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <thread>

#include "rtstdb/transaction/monotonic_clock.hpp"
#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

class FirmAtTheEdge : public testing::Test {
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

// After the queries the engine reads the clock for `computed`, for `published`, and once more after giving
// back.
TEST_F(FirmAtTheEdge, DeadlinePassesBetweenComputedAndPublished) {
  const Outcome& outcome = run_with_jump(2);
  EXPECT_LT(outcome.computed, transaction_->outcome().submitted + 1ms) << "computed in time";
  EXPECT_EQ(outcome.status, Status::missed);
  EXPECT_EQ(outcome.lateness, 1ms);
  EXPECT_EQ(world_.material(entity_), 1) << "taken back";
  EXPECT_EQ(world_.engine.latest().version, 1u);
  EXPECT_FALSE(transaction_->created(created_).valid());

  Version device_version = 2;  // an executor that was brought to the version taken back
  std::vector<std::uint32_t> changed;
  world_.executor.work = [&](const store::RowSource& rows, const auto&, const auto&) {
    EXPECT_TRUE(rows.changed_between(device_version, changed));
    return query::RunReport{};
  };
  transaction_->begin({});
  transaction_->add_query(query_, 1);
  EXPECT_EQ(world_.execute(*transaction_).version, 1u);
  EXPECT_EQ(std::set<std::uint32_t>(changed.begin(), changed.end()), (std::set<std::uint32_t>{0, 1}));

  EXPECT_EQ(world_.create(9), (EntityId{1, 1})) << "indices and generations as if it had never been";
  EXPECT_EQ(world_.engine.latest().version, 3u) << "but its number is not given again";
}

TEST_F(FirmAtTheEdge, DeadlinePassesAfterPublishing) {
  const Outcome& outcome = run_with_jump(3);
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(world_.material(entity_), 2);
  EXPECT_EQ(world_.engine.counts().firm_late_commits, 0u);
  EXPECT_EQ(world_.engine.counts().firm_delivered_late, 1u);
}

TEST_F(FirmAtTheEdge, TheFirstInstantThereIsHasPassedByTheLongestTime) {
  world_.clock.advance(1ms);
  for (const DeadlineClass late : {DeadlineClass::firm, DeadlineClass::soft, DeadlineClass::hard}) {
    transaction_->begin(terms(late, ClockTime::min()));
    transaction_->update(entity_, row_of(2));
    const Outcome& outcome = world_.execute(*transaction_);
    EXPECT_EQ(outcome.status, late == DeadlineClass::firm ? Status::missed : Status::late);
    EXPECT_EQ(outcome.lateness, Nanoseconds::max());
  }
}

TEST_F(FirmAtTheEdge, TheDeadlineItselfIsInTime) {
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

/// What is known of one transaction of the flood, by its serial number.
struct Fate {
  bool done = false;
  bool firm = false;
};

/// Several threads keep transactions in flight; the executor's costs are drawn from a seed and move the
/// clock.
class Flood {
 public:
  static constexpr std::uint32_t entities = 16;

  Flood(std::uint64_t seed, int threads, int in_flight, std::uint32_t each)
      : seed_(seed),
        threads_(threads),
        in_flight_(in_flight),
        each_(each),
        exits_(static_cast<std::size_t>(threads) * each + 1),
        seen_(exits_.size(), false),
        world_(engine_options(32, entities, 4096)) {
    world_.clock.per_reading_ns = 7;
    world_.executor.work = [this, random = std::mt19937_64(seed)](const store::RowSource& rows, const auto&,
                                                                  const auto&) mutable {
      // What stands in the rows of a version that is not this transaction's own was committed by somebody.
      for (std::uint32_t index = 0; index < rows.index_limit(); ++index) {
        const EntityState* state = rows.row(index);
        if (state != nullptr && state->written_by != rows.version()) seen_[state->row.material] = true;
      }
      world_.clock.advance(Nanoseconds(random() % 20 == 0 ? 400'000 : random() % 100'000));
      return query::RunReport{};
    };
    for (std::uint32_t k = 0; k < entities; ++k)
      world_.create(0);
  }

  void run() {
    std::vector<std::thread> threads;
    threads.reserve(static_cast<std::size_t>(threads_));
    for (int thread = 0; thread < threads_; ++thread)
      threads.emplace_back([this, thread] { submit_all(thread); });
    for (std::thread& thread : threads)
      thread.join();
  }

  void expect_firm_kept() {
    EXPECT_EQ(late_firm_commits_, 0u);
    const TransactionCounts counts = world_.engine.counts();
    EXPECT_EQ(counts.firm_late_commits, 0u);
    EXPECT_EQ(counts.submitted, static_cast<std::uint64_t>(threads_) * each_ + entities);
    EXPECT_EQ(counts.committed + counts.late + counts.missed + counts.refused + counts.cancelled,
              counts.submitted);
    EXPECT_GT(counts.committed, each_ / 20) << "or nothing was put to the test";
    // How many depends on which thread runs when.
    EXPECT_GT(counts.missed, each_ / 2000);
    EXPECT_GT(counts.refused, each_ / 2000);
    for (std::size_t serial = 1; serial < exits_.size(); ++serial) {
      ASSERT_TRUE(!seen_[serial] || exits_[serial].done) << "a trace of a transaction that came to nothing";
    }
  }

 private:
  void submit_all(int thread) {
    std::mt19937_64 random(seed_ * 1000 + static_cast<std::uint64_t>(thread));
    struct Slot {
      std::unique_ptr<Transaction> transaction;
      std::unique_ptr<SimulatedQuery> query;
      std::uint32_t serial = 0;
      ClockTime deadline{};
    };
    std::vector<Slot> slots(static_cast<std::size_t>(in_flight_));
    for (Slot& slot : slots) {
      slot.transaction = world_.make();
      slot.query = std::make_unique<SimulatedQuery>(4);
    }
    for (std::uint32_t k = 0; k < each_; ++k) {
      Slot& slot = slots[k % slots.size()];
      if (slot.serial != 0) collect(*slot.transaction, slot.serial, slot.deadline);
      slot.serial = static_cast<std::uint32_t>(thread) * each_ + k + 1;
      const bool firm = random() % 8 != 0;
      exits_[slot.serial].firm = firm;
      slot.deadline = world_.clock.now() + Nanoseconds(random() % 1'500'000);
      slot.transaction->begin(terms(firm ? DeadlineClass::firm : DeadlineClass::soft, slot.deadline,
                                    static_cast<std::uint8_t>(random() % 3)));
      slot.transaction->update({static_cast<std::uint32_t>(random() % entities), 1}, row_of(slot.serial));
      slot.transaction->update({static_cast<std::uint32_t>(random() % entities), 1}, row_of(slot.serial));
      if (random() % 4 != 0)
        slot.transaction->add_query(*slot.query, 1 + static_cast<std::uint32_t>(random() % 4));
      world_.engine.submit(*slot.transaction);
    }
    for (Slot& slot : slots) {
      if (slot.serial != 0) collect(*slot.transaction, slot.serial, slot.deadline);
    }
  }

  void collect(Transaction& transaction, std::uint32_t serial, ClockTime deadline) {
    const Outcome& outcome = world_.engine.wait(transaction);
    exits_[serial].done = outcome.done();
    if (exits_[serial].firm && outcome.done() && outcome.published > deadline) ++late_firm_commits_;
  }

  std::uint64_t seed_;
  int threads_;
  int in_flight_;
  std::uint32_t each_;
  std::vector<Fate> exits_;
  std::vector<bool> seen_;  ///< the engine thread alone, until it is joined or idle
  std::atomic<std::uint64_t> late_firm_commits_{0};
  World world_;
};

TEST(FirmNeverLate, UnderSeededLoadFromSeveralThreads) {
  // 10^5 transactions, from loads that fit to three times more than can be done.
  const std::pair<int, int> shapes[] = {{1, 2}, {2, 4}, {4, 4}, {8, 4}};
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const auto [threads, in_flight] = shapes[seed - 1];
    SCOPED_TRACE(testing::Message() << "seed " << seed << ", " << threads << " threads");
    Flood flood(seed, threads, in_flight, static_cast<std::uint32_t>(25000 / threads));
    flood.run();
    flood.expect_firm_kept();
  }
}

TEST(FirmNeverLate, OnTheKernelsClock) {
  const MonotonicClock clock;
  SimulatedExecutor executor;
  executor.work = [&](const auto&, const auto&, const auto&) {
    const ClockTime until = clock.now() + 20us;
    while (clock.now() < until) {
    }
    return query::RunReport{};
  };
  Engine engine(engine_options(), executor, clock);
  std::vector<std::thread> threads;
  threads.reserve(3);
  std::atomic<int> late{0};
  for (int k = 0; k < 3; ++k) {
    threads.emplace_back([&, k] {
      std::mt19937 random(static_cast<unsigned>(k));
      const auto transaction = engine.make_transaction(room_for(1, 0, 1));
      SimulatedQuery query(1);
      for (int round = 0; round < 2000; ++round) {
        const ClockTime deadline = clock.now() + Nanoseconds(random() % 300'000);
        transaction->begin(terms(DeadlineClass::firm, deadline));
        transaction->add_query(query, 1);
        if (round == 0) transaction->create(row_of(1));
        engine.submit(*transaction);
        const Outcome& outcome = engine.wait(*transaction);
        if (outcome.done() && outcome.published > deadline) ++late;
      }
    });
  }
  for (std::thread& thread : threads)
    thread.join();
  EXPECT_EQ(late, 0);
  EXPECT_EQ(engine.counts().firm_late_commits, 0u);
  EXPECT_EQ(engine.counts().submitted, 6000u);
}

}  // namespace
}  // namespace rtstdb::transaction::test
