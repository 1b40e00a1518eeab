// What admission promises, it keeps: under random loads, whoever runs, and for the deadline that it names.

#include <gtest/gtest.h>

#include <random>
#include <thread>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// Every element costs a microsecond, and the clock moves in nothing else.
class Admission : public testing::Test {
 protected:
  Admission() {
    world_.executor.chunk = [this](const auto&, const query::Request& request, std::uint32_t first,
                                   std::uint32_t end) {
      world_.clock.advance(1us * (end - first));
      if (in_every_chunk) in_every_chunk();
      if (happens && request.query == &large_ && first > 0) std::exchange(happens, nullptr)();
    };
    // Until it is known.
    for (std::uint32_t k = 0; k < 2 * scheduler::CostModel::min_samples; ++k) {
      const std::uint32_t count = 100 * (1 + k % 4);
      ask(*transaction_, small_, terms(DeadlineClass::soft), count);
      world_.execute(*transaction_);
      ask(*transaction_, large_, terms(DeadlineClass::soft), 10 * count);
      world_.execute(*transaction_);
    }
  }
  static void ask(Transaction& transaction, SimulatedQuery& query, const Terms& given, std::uint32_t count) {
    transaction.begin(given);
    transaction.add_query(query, count);
  }
  ClockTime in(Nanoseconds time) const { return world_.clock.peek() + time; }

  World world_;
  SimulatedQuery small_{1000};
  SimulatedQuery large_{100'000};
  std::unique_ptr<Transaction> transaction_ = world_.make();
  std::unique_ptr<Transaction> running_ = world_.make();
  std::function<void()> happens, in_every_chunk;
};

TEST_F(Admission, CountsWhatIsLeftOfTheOneThatRuns) {
  // 20 ms in chunks of half a millisecond; at the end of the second it is asked.
  happens = [&] {
    ask(*transaction_, small_, terms(DeadlineClass::firm, in(10ms)), 100);
    world_.engine.submit(*transaction_);
    EXPECT_EQ(world_.engine.wait(*transaction_).status, Status::refused) << "it does not go before";
  };
  ask(*running_, large_, terms(DeadlineClass::soft, in(1ms)), 20'000);
  world_.execute(*running_);
  const Outcome& refused = transaction_->outcome();
  EXPECT_GE(refused.earliest_feasible, refused.submitted + 19ms);
  EXPECT_LE(refused.earliest_feasible, refused.submitted + 19400us);
}

/// From then on elements cost so many times as much, and all that is asked is firm, at the deadline that is
/// named: what comes too late is given up between two chunks, and no run is done.
TEST_F(Admission, LearnsFromWhatItGivesUp) {
  for (const int times : {2, 3, 8}) {
    SCOPED_TRACE(times);
    world_.executor.chunk = [&](const auto&, const auto&, std::uint32_t first, std::uint32_t end) {
      world_.clock.advance(times * 1us * (end - first));
    };
    int broken = 0;
    int kept_in_a_row = 0;
    for (int k = 0; k < 200 && kept_in_a_row < 20; ++k) {
      ask(*transaction_, large_, terms(DeadlineClass::firm, in(100us)), 20'000);
      const Outcome refused = world_.execute(*transaction_);
      if (refused.status != Status::refused) continue;  // one of many is let in
      ask(*transaction_, large_, terms(DeadlineClass::firm, refused.earliest_feasible), 20'000);
      const bool kept = world_.execute(*transaction_).status == Status::committed;
      broken += kept ? 0 : 1;
      kept_in_a_row = kept ? kept_in_a_row + 1 : 0;
    }
    EXPECT_EQ(kept_in_a_row, 20);
    EXPECT_LE(broken, 5);
  }
}

/// One outlier makes it promise little for long; but at the usual cost it would be in time.
TEST_F(Admission, LetsOneOfFourInThatIsLikelyToBeInTime) {
  Nanoseconds each = 1us;
  world_.executor.chunk = [&](const auto&, const auto&, std::uint32_t first, std::uint32_t end) {
    world_.clock.advance(each * (end - first));
  };
  const auto asked_for = [&](Nanoseconds room) {
    ask(*transaction_, small_, terms(DeadlineClass::firm, in(room)), 400);
    return world_.execute(*transaction_).status;
  };
  for (int k = 0; k < 50; ++k)
    ASSERT_EQ(asked_for(1s), Status::committed);
  each = 8us;
  asked_for(1s);
  each = 1us;
  int let_in = 0;
  for (int k = 0; k < 40; ++k)
    let_in += asked_for(1ms) == Status::committed ? 1 : 0;
  EXPECT_EQ(let_in, 10);
  let_in = 0;
  for (int k = 0; k < 64; ++k)
    let_in += asked_for(100us) == Status::refused ? 0 : 1;
  EXPECT_EQ(let_in, 4) << "these are not";
}

TEST_F(Admission, CountsAChunkOfTheOneThatItInterrupts) {
  const auto second = world_.make();
  SimulatedQuery other(1000);
  happens = [&] {
    ask(*transaction_, small_, terms(DeadlineClass::firm, in(1050us), 1), 100);
    ask(*second, other, terms(DeadlineClass::firm, in(1350us), 1), 100);
    world_.engine.submit(*transaction_);
    world_.engine.submit(*second);
    EXPECT_EQ(world_.engine.wait(*transaction_).status, Status::refused) << "a chunk and its own";
  };
  ask(*running_, large_, terms(DeadlineClass::soft), 20'000);
  EXPECT_EQ(world_.execute(*running_).status, Status::committed);
  EXPECT_EQ(second->status(), Status::committed);
}

TEST_F(Admission, ANewcomerDoesNotBreakAPromise) {
  const auto first = world_.make();
  const auto second = world_.make();
  const auto third = world_.make();
  SimulatedQuery a(1000);
  SimulatedQuery b(1000);
  happens = [&] {
    ask(*first, small_, terms(DeadlineClass::firm, in(2ms), 1), 800);
    ask(*second, a, terms(DeadlineClass::firm, in(1900us), 1), 400);  // before the first, which would miss
    ask(*third, b, terms(DeadlineClass::firm, in(1900us), 2), 400);   // more important: its right
    for (const auto& transaction : {first.get(), second.get(), third.get()})
      world_.engine.submit(*transaction);
    EXPECT_EQ(world_.engine.wait(*second).status, Status::refused);
    EXPECT_EQ(second->outcome().earliest_feasible, first->outcome().submitted + 2300us);
  };
  ask(*running_, large_, terms(DeadlineClass::soft), 20'000);
  world_.execute(*running_);
  EXPECT_EQ(third->status(), Status::committed);
}

/// Those who pass the one that runs wait 20 ms for it in each gap, though it takes no longer than was
/// thought.
TEST_F(Admission, CountsOnGapsThatTakeAsLongAsTheyDid) {
  constexpr Nanoseconds gap = 20ms;
  const auto passing = world_.make();
  int gaps = 0;
  Status before = Status::idle;
  const auto ask_firm = [&] {
    ask(*transaction_, small_, terms(DeadlineClass::firm, in(10ms), 7), 100);
    world_.engine.submit(*transaction_);
  };
  SimulatedQuery passes(1000);
  world_.executor.chunk = [&](const auto&, const query::Request& request, std::uint32_t first,
                              std::uint32_t end) {
    world_.clock.advance(1us * (end - first));
    if (request.query != &large_) return;
    if (++gaps == 1) ask_firm();
    if (gaps == 2) before = transaction_->status();
    if (gaps == 2) world_.executor.while_draining = [&] { world_.clock.advance(gap); };
    if (gaps >= 2 && gaps < 20) {
      ask(*passing, passes, terms(DeadlineClass::soft, ClockTime::max(), 7), 100);
      world_.engine.submit(*passing);
    }
    if (gaps != 20) return;
    ask_firm();
    // If it is not refused, nobody could wait for it here.
    for (int k = 0; k < 5'000 && transaction_->status() == Status::pending; ++k)
      std::this_thread::sleep_for(1ms);
    ASSERT_EQ(transaction_->status(), Status::refused);
    EXPECT_GE(transaction_->outcome().earliest_feasible, transaction_->outcome().submitted + gap * 9 / 10);
  };
  ask(*running_, large_, terms(DeadlineClass::soft), 20'000);
  world_.execute(*running_);
  world_.executor.while_draining = nullptr;
  EXPECT_EQ(before, Status::committed) << "in time while gaps took no longer than was thought";
  EXPECT_GE(gaps, 20);
}

TEST(Calibration, KnowsTheCostsBeforeTheFirstTransaction) {
  World world;
  world.executor.chunk = [&](const auto&, const auto&, std::uint32_t first, std::uint32_t end) {
    world.clock.advance(1us * (end - first));
  };
  const EntityId entity = world.create(1);
  SimulatedQuery query(1000);
  const auto transaction = world.make();
  const auto declare = [&](const Terms& given, std::uint32_t count) {
    transaction->begin(given);
    transaction->update(entity, row_of(2));
    transaction->add_query(query, count);
  };
  declare(terms(DeadlineClass::soft), 800);
  const Version before = world.engine.latest().version;
  ASSERT_TRUE(world.engine.calibrate(*transaction).ok());
  EXPECT_EQ(world.engine.latest().version, before);
  EXPECT_EQ(world.material(entity), 1) << "nothing was published";
  EXPECT_EQ(transaction->status(), Status::idle);
  EXPECT_EQ(world.execute(*transaction).status, Status::committed) << "it is declared as it was";
  EXPECT_EQ(world.material(entity), 2);
  EXPECT_NEAR(static_cast<double>(transaction->outcome().predicted_cost.count()), 800'000.0, 1'000.0);
  declare(terms(DeadlineClass::firm, world.clock.peek() + 100us), 300);
  EXPECT_EQ(world.execute(*transaction).status, Status::refused) << "the first of them";

  transaction->begin({});
  transaction->update({9, 9}, row_of(2));
  const auto refused = world.engine.calibrate(*transaction);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message,
            "bad_input: entity 9 (generation 9) does not exist, in write 0; nothing was done");
}

/// Firm transactions that come at random while others run, one and a half times what can be done; who is
/// refused asks again at once for the deadline that was named.
class RandomAdmission : public Admission {
 protected:
  struct Asker {
    std::unique_ptr<Transaction> transaction;
    std::unique_ptr<SimulatedQuery> query;
  };

  /// In the middle of a chunk: time stands still.
  void come() {
    if (random_() % 8 != 0) return;
    Asker& asker = askers_[random_() % askers_.size()];
    if (asker.transaction->status() == Status::pending) return;
    collect(asker);
    const std::uint32_t count = 1 + static_cast<std::uint32_t>(random_() % 10'000);
    const Nanoseconds until = 1us * count + Nanoseconds(random_() % 30'000'000);
    const auto importance = static_cast<std::uint8_t>(1 + random_() % 2);
    submit(asker, terms(DeadlineClass::firm, in(until), importance), count);
    if (asker.transaction->status() != Status::refused) return;
    ++refused_;
    const ClockTime named = asker.transaction->outcome().earliest_feasible;
    EXPECT_GT(named, in(until));
    submit(asker, terms(DeadlineClass::firm, named, importance), count);
    named_and_refused_ += asker.transaction->status() == Status::refused;
  }
  void submit(Asker& asker, const Terms& given, std::uint32_t count) {
    ask(*asker.transaction, *asker.query, given, count);
    world_.engine.submit(*asker.transaction);
    // Once this has its outcome the one before it was looked at.
    probe_->begin(terms(DeadlineClass::firm, in(-1ns)));
    world_.engine.submit(*probe_);
    world_.engine.wait(*probe_);
  }
  void collect(Asker& asker) {
    const Status status = asker.transaction->status();
    kept_ += status == Status::committed;
    missed_ += status == Status::missed;
  }

  std::mt19937 random_{5};
  std::vector<Asker> askers_;
  std::unique_ptr<Transaction> probe_ = world_.make();
  int kept_ = 0, missed_ = 0, refused_ = 0, named_and_refused_ = 0;
};

TEST_F(RandomAdmission, KeepsWhatItPromises) {
  for (int k = 0; k < 12; ++k)
    askers_.push_back({world_.make(), std::make_unique<SimulatedQuery>(10'000)});
  in_every_chunk = [this] { come(); };
  for (int round = 0; round < 60; ++round) {
    ask(*running_, large_, terms(DeadlineClass::soft), 100'000);
    world_.execute(*running_);
  }
  in_every_chunk = nullptr;
  for (Asker& asker : askers_) {
    if (asker.transaction->status() != Status::idle) world_.engine.wait(*asker.transaction);
    collect(asker);
  }
  EXPECT_GT(kept_, 1000);
  EXPECT_GT(refused_, 100);
  EXPECT_EQ(named_and_refused_, 0) << "of " << refused_;
  const SchedulerCounts counts = world_.engine.scheduler_counts();
  EXPECT_GT(counts.promised, 1000u);
  EXPECT_EQ(counts.kept + counts.outranked, counts.promised)
      << "but by more important ones no promise is broken";
  EXPECT_GE(counts.kept, counts.promised * 3 / 4);
  ASSERT_EQ(counts.predictions.size(), 1u);
  EXPECT_EQ(counts.predictions[0].cost_class, "ray_closest");
  EXPECT_NEAR(counts.predictions[0].median, 1.0, 0.04);
}

}  // namespace
}  // namespace rtstdb::transaction::test
