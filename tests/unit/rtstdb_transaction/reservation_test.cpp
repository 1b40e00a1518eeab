// Reservations: refusals with their reasons, precedence over other transactions, and enforcement of period,
// budget and declaration.

#include <gtest/gtest.h>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// Each chunk of 4096 elements takes 500 us; `event` is called once in the second chunk of the large batch.
class Reservations : public testing::Test {
 protected:
  Reservations() {
    world_.executor.chunk = [this](const store::RowSource&, const query::Request& request,
                                   std::uint32_t first, std::uint32_t end) {
      const int label = label_of(request);
      trace_.push_back(label);
      world_.clock.advance(500us * (end - first) / unmeasured_chunk);
      if (label == large && first == unmeasured_chunk && event) std::exchange(event, nullptr)();
    };
  }
  std::unique_ptr<Reservation> reserve(const ReservationOptions& options) {
    auto reservation = world_.engine.reserve(options);
    EXPECT_TRUE(reservation.ok()) << reservation.error().message;
    return std::move(reservation).value();
  }
  std::string refusal(const ReservationOptions& options) {
    const auto reservation = world_.engine.reserve(options);
    return reservation.ok() ? "" : reservation.error().message;
  }
  static Terms reserved(const std::unique_ptr<Reservation>& reservation,
                        ClockTime deadline = ClockTime::max()) {
    Terms made = terms(DeadlineClass::hard, deadline);
    made.reservation = reservation.get();
    return made;
  }
  /// A batch of eight chunks.
  const Outcome& run_large(const Terms& given) {
    return world_.execute(begin_query(*large_, large_query_, given, 8 * unmeasured_chunk));
  }
  const Outcome& run_small(const Terms& given) {
    return world_.execute(begin_query(*small_, small_query_, given, unmeasured_chunk));
  }
  /// A chunk of a query of its own.
  void submit(Transaction& transaction, SimulatedQuery& query, const Terms& given) {
    world_.engine.submit(begin_query(transaction, query, given, unmeasured_chunk));
  }
  void write_and_query(Transaction& transaction, SimulatedQuery& query, const Terms& given,
                       std::uint32_t mask) {
    transaction.begin(given);
    transaction.update(entity_, row_of(mask));
    transaction.add_query(query, query.capacity());
  }

  static constexpr int large = 100;
  World world_;
  EntityId entity_ = world_.create(1);
  std::vector<int> trace_;
  std::function<void()> event;
  SimulatedQuery large_query_{8 * unmeasured_chunk, large};
  SimulatedQuery small_query_{unmeasured_chunk, 1}, other_query_{unmeasured_chunk, 2};
  std::unique_ptr<Transaction> large_ = world_.make();
  std::unique_ptr<Transaction> small_ = world_.make(), other_ = world_.make();
};

TEST_F(Reservations, AreRefusedWithTheirDemand) {
  const auto drive = reserve({.name = "drive", .period = 10ms, .deadline = 5ms, .budget = 2ms});
  EXPECT_EQ(refusal({.name = "scan", .period = 20ms, .deadline = 6ms, .budget = 2ms}),
            "reservation 'scan' (period 20 ms, deadline 6 ms, budget 2 ms) can not be kept: within 6 ms up "
            "to 5 ms may be demanded ('drive' 2 ms, 'scan' 2 ms, and 1 ms of other work that can not be "
            "preempted); 80 % of it, which can be reserved, is 4.8 ms");
  EXPECT_EQ(refusal({.name = "scan", .period = 20ms, .deadline = 20ms, .budget = 12ms}),
            "reservation 'scan' (period 20 ms, deadline 20 ms, budget 12 ms) can not be kept: all "
            "reservations together take 80 % of the time; less than 80 % can be reserved");
  const auto scan = reserve({.name = "scan", .period = 20ms, .deadline = 7ms, .budget = 2ms});
}

TEST_F(Reservations, HaveLimits) {
  const auto message = [&](Nanoseconds period, Nanoseconds deadline, Nanoseconds budget) {
    return refusal({.name = "r", .period = period, .deadline = deadline, .budget = budget});
  };
  EXPECT_EQ(message(0ms, 1ms, 1ms),
            "reservation 'r' (period 0 ms, deadline 1 ms, budget 1 ms): the period must be above 0 and "
            "at most 3600000 ms");
  EXPECT_EQ(
      message(1h + 1ns, 1ms, 1ms),
      "reservation 'r' (period 3600000.000001 ms, deadline 1 ms, budget 1 ms): the period must be above "
      "0 and at most 3600000 ms");
  EXPECT_NE(message(2h, 1ms, 1ms), "");
  EXPECT_NE(message(1ms, 0ms, 0ms), "");
  EXPECT_NE(message(1ms, 2h, 1ms), "");
  EXPECT_NE(message(1ms, 5ms, 0ms), "");
  EXPECT_NE(message(10ms, 5ms, 6ms), "");
  EXPECT_NE(message(-1ms, -1ms, -1ms), "");
}

TEST_F(Reservations, AreRefusedWithoutChunks) {
  EngineOptions options = engine_options();
  options.chunk = 0ns;
  World world(options);
  const auto refused = world.engine.reserve({.name = "r", .period = 1s, .deadline = 1s, .budget = 1ms});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message,
            "reservation 'r': DatabaseOptions::chunk is 0, so that other work can not be preempted");
}

TEST_F(Reservations, CountTheLongestMeasuredNonPreemptiblePart) {
  world_.executor.chunk = nullptr;
  world_.executor.work = [&](const auto&, const auto&, const auto&) {
    world_.clock.advance(16ms);
    return query::RunReport{.structures = {.built = true, .rows = 10, .entities = 10}};
  };
  const ReservationOptions options{.name = "r", .period = 50ms, .deadline = 5ms, .budget = 1ms};
  { const auto fits_before_a_build = reserve(options); }
  for (std::uint32_t k = 0; k < 40; ++k)
    run_small({});
  EXPECT_NE(refusal(options), "");
}

TEST_F(Reservations, ReturnTheirShareOnDestruction) {
  const ReservationOptions options{.name = "r", .period = 10ms, .deadline = 10ms, .budget = 6ms};
  { const auto one = reserve(options); }
  const auto one = reserve(options);
  EXPECT_NE(refusal(options), "");
  EXPECT_EQ(world_.engine.scheduler_counts().reservations.size(), 1u);
}

TEST_F(Reservations, PrecedeEveryImportanceByEarliestDeadline) {
  const auto slow = reserve({.name = "slow", .period = 100ms, .deadline = 50ms, .budget = 2ms});
  const auto fast = reserve({.name = "fast", .period = 100ms, .deadline = 20ms, .budget = 2ms});
  const auto important = world_.make();
  SimulatedQuery important_query(unmeasured_chunk, 3);
  event = [&] {
    submit(*important, important_query, terms(DeadlineClass::hard, world_.clock.peek() + 1ms, 7));
    submit(*small_, small_query_, reserved(slow));
    submit(*other_, other_query_, reserved(fast));
  };
  run_large(terms(DeadlineClass::soft));
  EXPECT_EQ(trace_, (std::vector<int>{large, large, 2, 1, 3, large, large, large, large, large, large}));
  EXPECT_EQ(slow->counts().kept, 1u);
  EXPECT_EQ(fast->counts().kept, 1u);
  EXPECT_EQ(fast->counts().longest_response, 500us);
  EXPECT_EQ(slow->counts().longest_response, 1ms);
  EXPECT_EQ(slow->counts().largest_cost, 500us);
}

TEST_F(Reservations, GiveTheirDeadlineToTransactionsWithoutOne) {
  const auto reservation = reserve({.name = "r", .period = 10ms, .deadline = 5ms, .budget = 1ms});
  world_.executor.chunk = [&](const auto&, const auto&, auto, auto) { world_.clock.advance(7ms); };
  const Outcome& outcome = run_small(reserved(reservation));
  EXPECT_EQ(outcome.status, Status::late);
  EXPECT_EQ(outcome.lateness, 2ms);
  EXPECT_EQ(reservation->counts().too_long, 1u);
  EXPECT_EQ(reservation->counts().broken, 0u);
}

TEST_F(Reservations, GiveNoPrecedenceMoreOftenThanTheirPeriod) {
  const auto reservation = reserve({.name = "r", .period = 10ms, .deadline = 10ms, .budget = 2ms});
  const auto first = world_.make();
  SimulatedQuery first_query(unmeasured_chunk, 0);
  event = [&] {
    submit(*first, first_query, reserved(reservation));
    submit(*small_, small_query_, reserved(reservation));  // the second one in a period
    submit(*other_, other_query_, terms(DeadlineClass::hard, ClockTime::max(), 1));
  };
  run_large(terms(DeadlineClass::soft));
  world_.engine.wait(*small_);
  EXPECT_EQ(trace_[2], 0);
  EXPECT_EQ(trace_[3], 2);
  EXPECT_EQ(trace_.back(), large) << "the second one runs before those without a deadline";
  const ReservationCounts counts = reservation->counts();
  EXPECT_EQ(counts.transactions, 2u);
  EXPECT_EQ(counts.kept, 1u);
  EXPECT_EQ(counts.too_often, 1u);
}

TEST_F(Reservations, TolerateJitter) {
  const auto reservation = reserve({.name = "r", .period = 10ms, .deadline = 5ms, .budget = 1ms});
  const ClockTime begin = world_.clock.peek();
  for (int k = 0; k < 100; ++k) {
    const ClockTime wanted = begin + 10ms * k + (k % 3 == 1 ? 4ms : 0ms);
    world_.clock.advance(wanted - world_.clock.peek());
    run_small(reserved(reservation));
  }
  EXPECT_EQ(reservation->counts().kept, 100u);
  // Deadlines of the transactions define the periods even if they come late.
  const ClockTime again = world_.clock.peek() + 20ms;
  for (int k = 0; k < 100; ++k) {
    const ClockTime release = again + 10ms * k;
    world_.clock.advance(release + (k % 2 == 1 ? 9ms : 0ms) - world_.clock.peek());
    run_small(reserved(reservation, release + 10ms));
  }
  EXPECT_EQ(reservation->counts().kept, 200u);
  EXPECT_EQ(reservation->counts().too_often, 0u);
  for (int k = 0; k < 100; ++k) {
    world_.clock.advance(4ms);  // each takes 500 us
    run_small(reserved(reservation));
  }
  EXPECT_NEAR(static_cast<double>(reservation->counts().too_often), 55.0, 3.0)
      << "4.5 ms apart instead of 10";
}

TEST_F(Reservations, GiveNoPrecedenceBeyondTheirBudget) {
  const auto too_long = reserve({.name = "too long", .period = 100ms, .deadline = 40ms, .budget = 1ms});
  const auto keeps = reserve({.name = "keeps", .period = 100ms, .deadline = 50ms, .budget = 1ms});
  event = [&] { submit(*small_, small_query_, reserved(keeps)); };
  const Outcome& outcome = run_large(reserved(too_long));
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(trace_, (std::vector<int>{large, large, large, 1, large, large, large, large, large}))
      << "due later, but within its budget";
  EXPECT_EQ(too_long->counts().too_long, 1u);
  EXPECT_EQ(too_long->counts().kept, 0u);
  EXPECT_EQ(keeps->counts().kept, 1u);
}

TEST_F(Reservations, GiveNoPrecedenceToUndeclaredWritesWithQueries) {
  const auto plain = reserve({.name = "plain", .period = 100ms, .deadline = 50ms, .budget = 5ms});
  const auto both =
      reserve({.name = "both", .period = 100ms, .deadline = 50ms, .budget = 5ms, .writes_and_queries = true});
  const auto run = [&](const std::unique_ptr<Reservation>& reservation) {
    write_and_query(*large_, large_query_, reserved(reservation), 2);
    event = [&] { submit(*small_, small_query_, terms(DeadlineClass::hard, world_.clock.peek() + 1ms, 7)); };
    trace_.clear();
    EXPECT_EQ(world_.execute(*large_).status, Status::committed);
    world_.engine.wait(*small_);
  };
  run(plain);
  EXPECT_EQ(trace_[2], 1);
  EXPECT_EQ(plain->counts().undeclared, 1u);
  run(both);
  EXPECT_EQ(trace_.back(), 1) << "it is not preempted";
  EXPECT_EQ(both->counts().kept, 1u);
}

TEST_F(Reservations, RestartAWriterWithStagedRows) {
  const auto declared =
      reserve({.name = "w", .period = 100ms, .deadline = 20ms, .budget = 2ms, .writes_and_queries = true});
  large_->begin(terms(DeadlineClass::soft, ClockTime::max(), 7));
  large_->update(entity_, row_of(5));
  large_->read(entity_);
  large_->add_query(large_query_, 8 * unmeasured_chunk);
  event = [&] {
    write_and_query(*small_, small_query_, reserved(declared), 7);
    world_.engine.submit(*small_);
  };
  const Outcome& outcome = world_.execute(*large_);
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(outcome.restarts, 1u);
  EXPECT_EQ(outcome.actual_cost, 4ms) << "of the last run";
  EXPECT_EQ(small_->outcome().status, Status::committed);
  EXPECT_EQ(declared->counts().longest_response, 500us);
  EXPECT_LT(small_->outcome().version, outcome.version);
  EXPECT_EQ(world_.mask(entity_), 5);
  EXPECT_EQ(trace_,
            (std::vector<int>{large, large, 1, large, large, large, large, large, large, large, large}));
  EXPECT_EQ(world_.engine.scheduler_counts().restarts, 1u);
}

TEST_F(Reservations, RestartedTransactionsCanBeCancelledAndMissed) {
  const auto declared =
      reserve({.name = "w", .period = 100ms, .deadline = 20ms, .budget = 2ms, .writes_and_queries = true});
  const auto interrupt = [&](const Terms& given) {
    write_and_query(*large_, large_query_, given, 5);
    world_.clock.advance(200ms);
    event = [&] {
      write_and_query(*small_, small_query_, reserved(declared), 7);
      world_.engine.submit(*small_);
    };
    return world_.execute(*large_).status;
  };
  EXPECT_EQ(interrupt(terms(DeadlineClass::firm, world_.clock.peek() + 201300us)), Status::missed);
  EXPECT_EQ(small_->status(), Status::committed);
  const auto inner = world_.executor.chunk;
  world_.executor.chunk = [&](const auto& rows, const auto& request, auto first, auto end) {
    inner(rows, request, first, end);
    if (request.query == &small_query_) world_.engine.cancel(*large_);
  };
  EXPECT_EQ(interrupt({}), Status::cancelled);
  EXPECT_EQ(world_.mask(entity_), 7);
}

TEST(ReservationsInAFullQueue, ReplaceTheTransactionOfLowestPriority) {
  World world(engine_options(2));
  auto reservation =
      std::move(world.engine.reserve({.name = "r", .period = 1s, .deadline = 1s, .budget = 1ms})).value();
  std::vector<std::unique_ptr<Transaction>> waiting;
  Gate gate;
  world.executor.work = [&](const auto&, const auto&, const auto&) {
    gate.pass();
    world.executor.work = nullptr;
    return query::RunReport{};
  };
  SimulatedQuery query(1);
  const auto held = world.make();
  world.engine.submit(begin_query(*held, query, {}));
  gate.wait_until_held();
  for (int k = 0; k < 2; ++k) {
    waiting.push_back(world.make());
    waiting.back()->begin(terms(DeadlineClass::hard, ClockTime::max(), static_cast<std::uint8_t>(1 + k)));
    world.engine.submit(*waiting.back());
  }
  const auto transaction = world.make();
  Terms given = terms(DeadlineClass::best_effort);
  given.reservation = reservation.get();
  transaction->begin(given);
  world.engine.submit(*transaction);
  gate.open();
  EXPECT_EQ(world.engine.wait(*transaction).status, Status::committed);
  EXPECT_EQ(world.engine.wait(*waiting[0]).cancelled_by, CancelledBy::full_queue);
  EXPECT_EQ(world.engine.wait(*waiting[1]).status, Status::committed);
  world.engine.wait(*held);
}

TEST_F(Reservations, CountForAdmission) {
  world_.executor.chunk = [&](const auto&, const auto&, std::uint32_t first, std::uint32_t end) {
    world_.clock.advance(1us * (end - first));
  };
  SimulatedQuery query(10'000);
  for (std::uint32_t k = 0; k < 64; ++k)
    world_.execute(begin_query(*large_, query, {}, 1000 * (1 + k % 4)));
  const auto firm = [&](Nanoseconds deadline) {
    return world_.execute(
        begin_query(*large_, query, terms(DeadlineClass::firm, world_.clock.peek() + deadline), 5000));
  };
  EXPECT_EQ(firm(5200us).status, Status::committed);
  const auto reservation = reserve({.name = "r", .period = 4ms, .deadline = 4ms, .budget = 1ms});
  const Outcome refused = firm(5200us);
  EXPECT_EQ(refused.status, Status::refused) << "two reserved transactions may run before it is done";
  EXPECT_NEAR(static_cast<double>((refused.earliest_feasible - refused.submitted).count()), 7.6e6, 0.1e6)
      << "5 ms, two budgets, and an eighth of 5 ms for the resubmission";
  EXPECT_EQ(firm(refused.earliest_feasible - refused.submitted).status, Status::committed);
}

TEST_F(Reservations, MayOutliveTheEngineThread) {
  const auto first = reserve({.name = "first", .period = 4ms, .deadline = 4ms, .budget = 1ms});
  auto second = reserve({.name = "second", .period = 4ms, .deadline = 4ms, .budget = 1ms});
  world_.engine.close();
  second.reset();
  ASSERT_EQ(world_.engine.scheduler_counts().reservations.size(), 1u);
  EXPECT_EQ(world_.engine.scheduler_counts().reservations.front().options.name, "first");
}

}  // namespace
}  // namespace rtstdb::transaction::test
