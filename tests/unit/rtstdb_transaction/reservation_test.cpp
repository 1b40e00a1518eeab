// Reservations as a caller has them: refused with the sums, kept before all others, and held to what they
// said.

#include <gtest/gtest.h>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

/// Each chunk of 4096 elements takes 500 us; what happens in the second one of a large batch is a test's own.
class Reserving : public testing::Test {
 protected:
  Reserving() {
    world_.executor.chunk = [this](const store::RowSource&, const query::Request& request,
                                   std::uint32_t first, std::uint32_t end) {
      const int label = dynamic_cast<SimulatedQuery&>(*request.query).label;
      trace_.push_back(label);
      world_.clock.advance(500us * (end - first) / unmeasured_chunk);
      if (label == large && first == unmeasured_chunk && happens) std::exchange(happens, nullptr)();
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
  Transaction& ask(Transaction& transaction, SimulatedQuery& query, const Terms& given,
                   std::uint32_t count = unmeasured_chunk) {
    transaction.begin(given);
    transaction.add_query(query, count);
    return transaction;
  }
  /// A batch of eight chunks.
  const Outcome& run_large(const Terms& given) {
    return world_.execute(ask(*large_, large_query_, given, 8 * unmeasured_chunk));
  }
  const Outcome& run_small(const Terms& given) { return world_.execute(ask(*small_, small_query_, given)); }

  static constexpr int large = 100;
  World world_;
  EntityId entity_ = world_.create(1);
  std::vector<int> trace_;
  std::function<void()> happens;
  SimulatedQuery large_query_{8 * unmeasured_chunk, large};
  SimulatedQuery small_query_{unmeasured_chunk, 1}, other_query_{unmeasured_chunk, 2};
  std::unique_ptr<Transaction> large_ = world_.make();
  std::unique_ptr<Transaction> small_ = world_.make(), other_ = world_.make();
};

TEST_F(Reserving, IsRefusedWithTheSums) {
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

TEST_F(Reserving, RefusesWhatIsNoReservation) {
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

TEST_F(Reserving, WithoutChunksNothingCanBePromised) {
  EngineOptions options = engine_options();
  options.chunk = 0ns;
  World world(options);
  const auto refused = world.engine.reserve({.name = "r", .period = 1s, .deadline = 1s, .budget = 1ms});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().message,
            "reservation 'r': DatabaseOptions::chunk is 0, so that other work can not be preempted");
}

TEST_F(Reserving, TheLongestMeasuredPieceCounts) {
  world_.executor.chunk = nullptr;
  world_.executor.work = [&](const auto&, const auto&, const auto&) {
    world_.clock.advance(16ms);
    return query::RunReport{.structures = {.built = true, .rows = 10, .entities = 10}};
  };
  const ReservationOptions options{.name = "r", .period = 50ms, .deadline = 5ms, .budget = 1ms};
  { const auto fits_while_nothing_was_built = reserve(options); }
  for (std::uint32_t k = 0; k < 40; ++k)
    run_small({});
  EXPECT_NE(refusal(options), "");
}

TEST_F(Reserving, GivesItsShareBack) {
  const ReservationOptions most{.name = "r", .period = 10ms, .deadline = 10ms, .budget = 6ms};
  { const auto one = reserve(most); }
  const auto one = reserve(most);
  EXPECT_NE(refusal(most), "");
  EXPECT_EQ(world_.engine.scheduler_counts().reservations.size(), 1u);
}

TEST_F(Reserving, GoesBeforeWhatIsMostImportantByWhenItIsDue) {
  const auto slow = reserve({.name = "slow", .period = 100ms, .deadline = 50ms, .budget = 2ms});
  const auto fast = reserve({.name = "fast", .period = 100ms, .deadline = 20ms, .budget = 2ms});
  const auto important = world_.make();
  SimulatedQuery important_query(unmeasured_chunk, 3);
  happens = [&] {
    world_.engine.submit(
        ask(*important, important_query, terms(DeadlineClass::hard, world_.clock.peek() + 1ms, 7)));
    world_.engine.submit(ask(*small_, small_query_, reserved(slow)));
    world_.engine.submit(ask(*other_, other_query_, reserved(fast)));
  };
  run_large(terms(DeadlineClass::soft));
  EXPECT_EQ(trace_, (std::vector<int>{large, large, 2, 1, 3, large, large, large, large, large, large}));
  EXPECT_EQ(slow->counts().kept, 1u);
  EXPECT_EQ(fast->counts().kept, 1u);
  EXPECT_EQ(fast->counts().longest_response, 500us);
  EXPECT_EQ(slow->counts().longest_response, 1ms);
  EXPECT_EQ(slow->counts().largest_cost, 500us);
}

TEST_F(Reserving, ATransactionWithoutADeadlineGetsTheReservations) {
  const auto reservation = reserve({.name = "r", .period = 10ms, .deadline = 5ms, .budget = 1ms});
  world_.executor.chunk = [&](const auto&, const auto&, auto, auto) { world_.clock.advance(7ms); };
  const Outcome& outcome = run_small(reserved(reservation));
  EXPECT_EQ(outcome.status, Status::late);
  EXPECT_EQ(outcome.lateness, 2ms);
  EXPECT_EQ(reservation->counts().too_long, 1u);
  EXPECT_EQ(reservation->counts().broken, 0u);
}

TEST_F(Reserving, MoreOftenThanItsPeriodHasTheRankOfItsTerms) {
  const auto reservation = reserve({.name = "r", .period = 10ms, .deadline = 10ms, .budget = 2ms});
  const auto first = world_.make();
  SimulatedQuery first_query(unmeasured_chunk, 0);
  happens = [&] {
    world_.engine.submit(ask(*first, first_query, reserved(reservation)));
    world_.engine.submit(ask(*small_, small_query_, reserved(reservation)));  // at once
    world_.engine.submit(ask(*other_, other_query_, terms(DeadlineClass::hard, ClockTime::max(), 1)));
  };
  run_large(terms(DeadlineClass::soft));
  world_.engine.wait(*small_);
  EXPECT_EQ(trace_[2], 0);
  EXPECT_EQ(trace_[3], 2);
  EXPECT_EQ(trace_.back(), large) << "by its deadline it goes before one that has none";
  const ReservationCounts counts = reservation->counts();
  EXPECT_EQ(counts.transactions, 2u);
  EXPECT_EQ(counts.kept, 1u);
  EXPECT_EQ(counts.too_often, 1u);
}

TEST_F(Reserving, JitterIsNotTooOften) {
  const auto reservation = reserve({.name = "r", .period = 10ms, .deadline = 5ms, .budget = 1ms});
  const ClockTime begin = world_.clock.peek();
  for (int k = 0; k < 100; ++k) {
    const ClockTime wanted = begin + 10ms * k + (k % 3 == 1 ? 4ms : 0ms);
    world_.clock.advance(wanted - world_.clock.peek());
    run_small(reserved(reservation));
  }
  EXPECT_EQ(reservation->counts().kept, 100u);
  // Its own deadlines tell the periods even where it comes late.
  const ClockTime again = world_.clock.peek() + 20ms;
  for (int k = 0; k < 100; ++k) {
    const ClockTime release = again + 10ms * k;
    world_.clock.advance(release + (k % 2 == 1 ? 9ms : 0ms) - world_.clock.peek());
    run_small(reserved(reservation, release + 10ms));
  }
  EXPECT_EQ(reservation->counts().kept, 200u);
  EXPECT_EQ(reservation->counts().too_often, 0u);
  for (int k = 0; k < 100; ++k) {
    world_.clock.advance(4ms);  // and 500 us of its own
    run_small(reserved(reservation));
  }
  EXPECT_NEAR(static_cast<double>(reservation->counts().too_often), 55.0, 3.0)
      << "4.5 ms apart instead of 10";
}

TEST_F(Reserving, LongerThanItsBudgetIsPassed) {
  const auto too_long = reserve({.name = "too long", .period = 100ms, .deadline = 40ms, .budget = 1ms});
  const auto keeps = reserve({.name = "keeps", .period = 100ms, .deadline = 50ms, .budget = 1ms});
  happens = [&] { world_.engine.submit(ask(*small_, small_query_, reserved(keeps))); };
  const Outcome& outcome = run_large(reserved(too_long));
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(trace_, (std::vector<int>{large, large, large, 1, large, large, large, large, large}))
      << "due later, but it keeps to what it said";
  EXPECT_EQ(too_long->counts().too_long, 1u);
  EXPECT_EQ(too_long->counts().kept, 0u);
  EXPECT_EQ(keeps->counts().kept, 1u);
}

TEST_F(Reserving, WritesAndAsksAreDeclared) {
  const auto plain = reserve({.name = "plain", .period = 100ms, .deadline = 50ms, .budget = 5ms});
  const auto both =
      reserve({.name = "both", .period = 100ms, .deadline = 50ms, .budget = 5ms, .writes_and_queries = true});
  const auto write_and_ask = [&](const std::unique_ptr<Reservation>& reservation) {
    large_->begin(reserved(reservation));
    large_->update(entity_, row_of(2));
    large_->add_query(large_query_, 8 * unmeasured_chunk);
    happens = [&] {
      world_.engine.submit(
          ask(*small_, small_query_, terms(DeadlineClass::hard, world_.clock.peek() + 1ms, 7)));
    };
    trace_.clear();
    EXPECT_EQ(world_.execute(*large_).status, Status::committed);
    world_.engine.wait(*small_);
  };
  write_and_ask(plain);
  EXPECT_EQ(trace_[2], 1);
  EXPECT_EQ(plain->counts().undeclared, 1u);
  write_and_ask(both);
  EXPECT_EQ(trace_.back(), 1) << "it is one piece";
  EXPECT_EQ(both->counts().kept, 1u);
}

TEST_F(Reserving, OneThatHasStagedBeginsAnewBehindAReservedWriter) {
  const auto declared =
      reserve({.name = "w", .period = 100ms, .deadline = 20ms, .budget = 2ms, .writes_and_queries = true});
  large_->begin(terms(DeadlineClass::soft, ClockTime::max(), 7));
  large_->update(entity_, row_of(5));
  large_->read(entity_);
  large_->add_query(large_query_, 8 * unmeasured_chunk);
  happens = [&] {
    small_->begin(reserved(declared));
    small_->update(entity_, row_of(7));
    small_->add_query(small_query_, unmeasured_chunk);
    world_.engine.submit(*small_);
  };
  const Outcome& outcome = world_.execute(*large_);
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_EQ(outcome.restarts, 1u);
  EXPECT_EQ(outcome.actual_cost, 4ms) << "of the last time";
  EXPECT_EQ(small_->outcome().status, Status::committed);
  EXPECT_EQ(declared->counts().longest_response, 500us);
  EXPECT_LT(small_->outcome().version, outcome.version);
  EXPECT_EQ(world_.material(entity_), 5);
  EXPECT_EQ(trace_,
            (std::vector<int>{large, large, 1, large, large, large, large, large, large, large, large}));
  EXPECT_EQ(world_.engine.scheduler_counts().restarts, 1u);
}

TEST_F(Reserving, OneThatBeginsAnewCanBeCancelledAndMissed) {
  const auto declared =
      reserve({.name = "w", .period = 100ms, .deadline = 20ms, .budget = 2ms, .writes_and_queries = true});
  const auto interrupt = [&](const Terms& given) {
    large_->begin(given);
    large_->update(entity_, row_of(5));
    large_->add_query(large_query_, 8 * unmeasured_chunk);
    world_.clock.advance(200ms);
    happens = [&] {
      small_->begin(reserved(declared));
      small_->update(entity_, row_of(7));
      small_->add_query(small_query_, unmeasured_chunk);
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
  EXPECT_EQ(world_.material(entity_), 7);
}

TEST(ReservingInAFullQueue, TheReservedOneIsLetIn) {
  World world(engine_options(2));
  auto reservation =
      std::move(world.engine.reserve({.name = "r", .period = 1s, .deadline = 1s, .budget = 1ms})).value();
  std::vector<std::unique_ptr<Transaction>> flood;
  Gate gate;
  world.executor.work = [&](const auto&, const auto&, const auto&) {
    gate.pass();
    world.executor.work = nullptr;
    return query::RunReport{};
  };
  SimulatedQuery query(1);
  const auto held = world.make();
  held->begin({});
  held->add_query(query, 1);
  world.engine.submit(*held);
  gate.wait_until_somebody_stands_there();
  for (int k = 0; k < 2; ++k) {
    flood.push_back(world.make());
    flood.back()->begin(terms(DeadlineClass::hard, ClockTime::max(), static_cast<std::uint8_t>(1 + k)));
    world.engine.submit(*flood.back());
  }
  const auto transaction = world.make();
  Terms given = terms(DeadlineClass::best_effort);
  given.reservation = reservation.get();
  transaction->begin(given);
  world.engine.submit(*transaction);
  gate.open();
  EXPECT_EQ(world.engine.wait(*transaction).status, Status::committed);
  EXPECT_EQ(world.engine.wait(*flood[0]).cancelled_by, CancelledBy::full_queue)
      << "the least urgent of the others";
  EXPECT_EQ(world.engine.wait(*flood[1]).status, Status::committed);
  world.engine.wait(*held);
}

TEST_F(Reserving, AdmissionLeavesRoomForWhatMayStillCome) {
  world_.executor.chunk = [&](const auto&, const auto&, std::uint32_t first, std::uint32_t end) {
    world_.clock.advance(1us * (end - first));
  };
  SimulatedQuery query(10'000);
  for (std::uint32_t k = 0; k < 64; ++k)
    world_.execute(ask(*large_, query, {}, 1000 * (1 + k % 4)));
  const auto firm = [&](Nanoseconds deadline) {
    return world_.execute(
        ask(*large_, query, terms(DeadlineClass::firm, world_.clock.peek() + deadline), 5000));
  };
  EXPECT_EQ(firm(5200us).status, Status::committed);
  const auto reservation = reserve({.name = "r", .period = 4ms, .deadline = 4ms, .budget = 1ms});
  const Outcome refused = firm(5200us);
  EXPECT_EQ(refused.status, Status::refused) << "two of them may come before it is done";
  EXPECT_NEAR(static_cast<double>((refused.earliest_feasible - refused.submitted).count()), 7.6e6, 0.1e6)
      << "5 and 2, and an eighth of 5 to ask for it";
  EXPECT_EQ(firm(refused.earliest_feasible - refused.submitted).status, Status::committed);
}

TEST_F(Reserving, OneMayOutliveTheEnginesThread) {
  const auto first = reserve({.name = "first", .period = 4ms, .deadline = 4ms, .budget = 1ms});
  auto second = reserve({.name = "second", .period = 4ms, .deadline = 4ms, .budget = 1ms});
  world_.engine.close();
  second.reset();
  ASSERT_EQ(world_.engine.scheduler_counts().reservations.size(), 1u);
  EXPECT_EQ(world_.engine.scheduler_counts().reservations.front().options.name, "first");
}

}  // namespace
}  // namespace rtstdb::transaction::test
