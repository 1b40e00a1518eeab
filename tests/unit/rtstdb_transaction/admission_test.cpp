// Admission keeps its promises and names deadlines that can be met, also under random loads.

#include <gtest/gtest.h>

#include <random>

#include "tests/support/eventually.hpp"
#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// Every element takes a microsecond; nothing else takes time.
class Admission : public testing::Test {
 protected:
  Admission() {
    world_.executor.chunk = [this](const auto&, const query::Request& request, std::uint32_t first,
                                   std::uint32_t end) {
      world_.clock.advance(1us * (end - first));
      if (in_every_chunk) in_every_chunk();
      if (event && request.query == &large_ && first > 0) std::exchange(event, nullptr)();
    };
    // Until the cost model knows both queries.
    for (std::uint32_t k = 0; k < 2 * scheduler::CostModel::min_samples; ++k) {
      const std::uint32_t count = 100 * (1 + k % 4);
      world_.execute(begin_query(*transaction_, small_, terms(DeadlineClass::soft), count));
      world_.execute(begin_query(*transaction_, large_, terms(DeadlineClass::soft), 10 * count));
    }
  }
  const Outcome& run_large(const Terms& given, std::uint32_t count = 20'000) {
    return world_.execute(begin_query(*running_, large_, given, count));
  }
  Terms firm(Nanoseconds time, std::uint8_t importance = 0) const {
    return terms(DeadlineClass::firm, in(time), importance);
  }
  ClockTime in(Nanoseconds time) const { return world_.clock.peek() + time; }

  World world_;
  SimulatedQuery small_{1000};
  SimulatedQuery large_{100'000};
  std::unique_ptr<Transaction> transaction_ = world_.make();
  std::unique_ptr<Transaction> running_ = world_.make();
  std::function<void()> event;  ///< in the second chunk of the large query
  std::function<void()> in_every_chunk;
};

TEST_F(Admission, CountsTheRemainingTimeOfTheRunningTransaction) {
  // 20 ms in chunks of half a millisecond; the firm transaction comes in the second chunk.
  event = [&] {
    begin_query(*transaction_, small_, firm(10ms), 100);
    EXPECT_EQ(world_.execute(*transaction_).status, Status::refused) << "it does not preempt";
  };
  run_large(terms(DeadlineClass::soft, in(1ms)));
  const Outcome& refused = transaction_->outcome();
  EXPECT_GE(refused.earliest_feasible, refused.submitted + 19ms);
  EXPECT_LE(refused.earliest_feasible, refused.submitted + 19400us);
}

/// A query that is always stopped at its deadline never completes. Its cost is known by what it answers until
/// then.
TEST_F(Admission, RefusesAQueryThatNeverFits) {
  SimulatedQuery never{20'000, 0, query::CostClass::cone};
  int missed = 0, refused = 0;
  for (std::uint64_t k = 0; k < 2 * scheduler::CostModel::min_samples; ++k) {
    const Outcome outcome = world_.execute(begin_query(*transaction_, never, firm(5ms), 20'000));
    EXPECT_FALSE(outcome.done());
    missed += outcome.status == Status::missed ? 1 : 0;
    refused += outcome.status == Status::refused ? 1 : 0;
    if (outcome.status != Status::refused) continue;
    EXPECT_GE(outcome.earliest_feasible, outcome.submitted + 19ms);
    EXPECT_LE(outcome.earliest_feasible, outcome.submitted + 25ms);
  }
  EXPECT_EQ(missed, 17) << "until there are enough measurements, and once after 15 refusals";
  EXPECT_EQ(refused, 15);
  EXPECT_EQ(world_.execute(begin_query(*transaction_, never, firm(30ms), 20'000)).status, Status::committed);
}

/// Elements cost `factor` times as much as before. Firm transactions at the deadline that a refusal names are
/// missed at a preemption point, so that no run completes until the cost model has been updated.
TEST_F(Admission, AdaptsToMissedTransactions) {
  for (const int factor : {2, 3, 8}) {
    SCOPED_TRACE(factor);
    world_.executor.chunk = [&](const auto&, const auto&, std::uint32_t first, std::uint32_t end) {
      world_.clock.advance(factor * 1us * (end - first));
    };
    int broken = 0;
    int kept_in_a_row = 0;
    for (int k = 0; k < 200 && kept_in_a_row < 20; ++k) {
      const Outcome refused = run_large(firm(100us));
      if (refused.status != Status::refused) continue;  // some are admitted to measure their cost
      const bool kept =
          run_large(terms(DeadlineClass::firm, refused.earliest_feasible)).status == Status::committed;
      broken += kept ? 0 : 1;
      kept_in_a_row = kept ? kept_in_a_row + 1 : 0;
    }
    EXPECT_EQ(kept_in_a_row, 20);
    EXPECT_LE(broken, 5);
  }
}

/// After an outlier, admission is cautious for long; transactions that meet the deadline at the usual cost
/// are admitted at a fixed rate.
TEST_F(Admission, TriesOneOfFourTransactionsThatAreLikelyToBeInTime) {
  Nanoseconds each = 1us;
  world_.executor.chunk = [&](const auto&, const auto&, std::uint32_t first, std::uint32_t end) {
    world_.clock.advance(each * (end - first));
  };
  const auto run_within = [&](Nanoseconds time) {
    return world_.execute(begin_query(*transaction_, small_, firm(time), 400)).status;
  };
  for (int k = 0; k < 50; ++k)
    ASSERT_EQ(run_within(1s), Status::committed);
  each = 8us;
  run_within(1s);
  each = 1us;
  int admitted = 0;
  for (int k = 0; k < 40; ++k)
    admitted += run_within(1ms) == Status::committed ? 1 : 0;
  EXPECT_EQ(admitted, 10);
  admitted = 0;
  for (int k = 0; k < 64; ++k)
    admitted += run_within(100us) == Status::refused ? 0 : 1;
  EXPECT_EQ(admitted, 4) << "these are not likely to be in time";
}

TEST_F(Admission, CountsTheCurrentChunkOfThePreemptedTransaction) {
  const auto second = world_.make();
  SimulatedQuery other(1000);
  event = [&] {
    world_.engine.submit(begin_query(*transaction_, small_, firm(1050us, 1), 100));
    world_.engine.submit(begin_query(*second, other, firm(1350us, 1), 100));
    EXPECT_EQ(world_.engine.wait(*transaction_).status, Status::refused) << "a chunk and its own time";
  };
  EXPECT_EQ(run_large(terms(DeadlineClass::soft)).status, Status::committed);
  EXPECT_EQ(second->status(), Status::committed);
}

TEST_F(Admission, DoesNotBreakEarlierPromises) {
  const auto first = world_.make();
  const auto second = world_.make();
  const auto third = world_.make();
  SimulatedQuery a(1000);
  SimulatedQuery b(1000);
  event = [&] {
    begin_query(*first, small_, firm(2ms, 1), 800);
    begin_query(*second, a, firm(1900us, 1), 400);  // runs before the first, which then misses its deadline
    begin_query(*third, b, firm(1900us, 2), 400);   // a higher importance may break the promise
    for (const auto& transaction : {first.get(), second.get(), third.get()})
      world_.engine.submit(*transaction);
    EXPECT_EQ(world_.engine.wait(*second).status, Status::refused);
    EXPECT_EQ(second->outcome().earliest_feasible, first->outcome().submitted + 2300us);
  };
  run_large(terms(DeadlineClass::soft));
  EXPECT_EQ(third->status(), Status::committed);
}

/// Transactions that preempt the running one wait 20 ms each, longer than predicted.
TEST_F(Admission, CountsTheMeasuredPreemptionLatency) {
  constexpr Nanoseconds latency = 20ms;
  const auto preempting = world_.make();
  SimulatedQuery preempting_query(1000);
  int chunks = 0;
  Status before = Status::idle;
  const auto submit_firm = [&] {
    world_.engine.submit(begin_query(*transaction_, small_, firm(10ms, 7), 100));
  };
  world_.executor.chunk = [&](const auto&, const query::Request& request, std::uint32_t first,
                              std::uint32_t end) {
    world_.clock.advance(1us * (end - first));
    if (request.query != &large_) return;
    if (++chunks == 1) submit_firm();
    if (chunks == 2) before = transaction_->status();
    if (chunks == 2) world_.executor.while_draining = [&] { world_.clock.advance(latency); };
    if (chunks >= 2 && chunks < 20)
      world_.engine.submit(begin_query(*preempting, preempting_query, soft_terms(7), 100));
    if (chunks != 20) return;
    submit_firm();
    // Not Engine::wait: the engine thread, which is here, executes it if it is not refused.
    ASSERT_TRUE(hil::tests::eventually([&] { return transaction_->status() != Status::pending; }));
    ASSERT_EQ(transaction_->status(), Status::refused);
    EXPECT_GE(transaction_->outcome().earliest_feasible,
              transaction_->outcome().submitted + latency * 9 / 10);
  };
  run_large(terms(DeadlineClass::soft));
  world_.executor.while_draining = nullptr;
  EXPECT_EQ(before, Status::committed) << "in time while the latency is as predicted";
  EXPECT_GE(chunks, 20);
}

TEST(Calibration, MeasuresTheCostBeforeTheFirstTransaction) {
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
  EXPECT_EQ(world.mask(entity), 1) << "nothing was published";
  EXPECT_EQ(transaction->status(), Status::idle);
  EXPECT_EQ(world.execute(*transaction).status, Status::committed) << "calibrate keeps what was declared";
  EXPECT_EQ(world.mask(entity), 2);
  EXPECT_NEAR(static_cast<double>(transaction->outcome().predicted_cost.count()), 800'000.0, 1'000.0);
  declare(terms(DeadlineClass::firm, world.clock.peek() + 100us), 300);
  EXPECT_EQ(world.execute(*transaction).status, Status::refused) << "the first firm transaction";

  transaction->begin({});
  transaction->update({9, 9}, row_of(2));
  const auto refused = world.engine.calibrate(*transaction);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message,
            "bad_input: entity 9 (generation 9) does not exist, in write 0; nothing was done");
}

/// Random firm transactions during a run, one and a half times of what the device can do. A refused one is
/// submitted again at once with the deadline that the refusal names.
class RandomAdmission : public Admission {
 protected:
  struct Client {
    std::unique_ptr<Transaction> transaction;
    std::unique_ptr<SimulatedQuery> query;
  };

  /// Called within a chunk; time does not pass.
  void submit_randomly() {
    if (random_() % 8 != 0) return;
    Client& client = clients_[random_() % clients_.size()];
    if (client.transaction->status() == Status::pending) return;
    collect(client);
    const std::uint32_t count = 1 + static_cast<std::uint32_t>(random_() % 10'000);
    const Nanoseconds until = 1us * count + Nanoseconds(random_() % 30'000'000);
    const auto importance = static_cast<std::uint8_t>(1 + random_() % 2);
    submit(client, terms(DeadlineClass::firm, in(until), importance), count);
    if (client.transaction->status() != Status::refused) return;
    ++refused_;
    const ClockTime named = client.transaction->outcome().earliest_feasible;
    EXPECT_GT(named, in(until));
    submit(client, terms(DeadlineClass::firm, named, importance), count);
    named_and_refused_ += client.transaction->status() == Status::refused;
  }
  void submit(Client& client, const Terms& given, std::uint32_t count) {
    world_.engine.submit(begin_query(*client.transaction, *client.query, given, count));
    // Admission has decided about the client's transaction when the probe has its outcome.
    probe_->begin(firm(-1ns));
    world_.execute(*probe_);
  }
  void collect(Client& client) {
    const Status status = client.transaction->status();
    kept_ += status == Status::committed;
    missed_ += status == Status::missed;
  }

  std::mt19937 random_{5};
  std::vector<Client> clients_;
  std::unique_ptr<Transaction> probe_ = world_.make();
  int kept_ = 0, missed_ = 0, refused_ = 0, named_and_refused_ = 0;
};

TEST_F(RandomAdmission, KeepsAllPromises) {
  for (int k = 0; k < 12; ++k)
    clients_.push_back({world_.make(), std::make_unique<SimulatedQuery>(10'000)});
  in_every_chunk = [this] { submit_randomly(); };
  for (int round = 0; round < 60; ++round) {
    run_large(terms(DeadlineClass::soft), 100'000);
  }
  in_every_chunk = nullptr;
  for (Client& client : clients_) {
    if (client.transaction->status() != Status::idle) world_.engine.wait(*client.transaction);
    collect(client);
  }
  EXPECT_GT(kept_, 1000);
  EXPECT_GT(refused_, 100);
  EXPECT_EQ(named_and_refused_, 0) << "of " << refused_;
  const SchedulerCounts counts = world_.engine.scheduler_counts();
  EXPECT_GT(counts.promised, 1000u);
  EXPECT_EQ(counts.kept + counts.outranked, counts.promised) << "only a higher importance breaks a promise";
  EXPECT_GE(counts.kept, counts.promised * 3 / 4);
  ASSERT_EQ(counts.predictions.size(), 1u);
  EXPECT_EQ(counts.predictions[0].cost_class, "ray_closest");
  EXPECT_NEAR(counts.predictions[0].median, 1.0, 0.04);
}

}  // namespace
}  // namespace rtstdb::transaction::test
