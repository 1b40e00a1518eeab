// Each status of a transaction, and its effect.

#include <gtest/gtest.h>

#include <cmath>

#include <rtstdb/limits.hpp>

#include "tests/support/simulation/engine.hpp"

namespace rtstdb::transaction::test {
namespace {

using namespace std::chrono_literals;

class Statuses : public testing::Test {
 protected:
  /// A transaction that sets the mask of `entity_` to 2 and has one ray.
  std::unique_ptr<Transaction> change(const Terms& given) {
    auto transaction = world_.make();
    transaction->begin(given);
    transaction->update(entity_, row_of(2));
    transaction->add_query(query_, 1);
    return transaction;
  }
  void executor_takes(Nanoseconds cost, query::RunStatus status = query::RunStatus::done) {
    world_.executor.work = [this, cost, status](const auto&, const auto&, const auto&) {
      world_.clock.advance(cost);
      return query::RunReport{status, 700};
    };
  }

  World world_;
  EntityId entity_ = world_.create(1);
  SimulatedQuery query_{4};
  ClockTime now_ = world_.clock.peek();
};

TEST_F(Statuses, CommittedHasFiveInstants) {
  executor_takes(300us);
  world_.clock.per_reading_ns = 10;
  const auto transaction = change(terms(DeadlineClass::firm, now_ + 1ms));
  EXPECT_EQ(transaction->status(), Status::idle) << "until it is submitted";
  const Outcome& outcome = world_.execute(*transaction);
  EXPECT_EQ(outcome.status, Status::committed);
  EXPECT_TRUE(outcome.done());
  EXPECT_EQ(outcome.version, 2u);
  EXPECT_EQ(outcome.version_time, WorldTime{});
  EXPECT_LT(outcome.submitted, outcome.admitted);
  EXPECT_LT(outcome.admitted, outcome.started);
  EXPECT_GE(outcome.computed, outcome.started + 300us);
  EXPECT_LT(outcome.computed, outcome.published);
  EXPECT_EQ(outcome.actual_cost, outcome.published - outcome.started);
  EXPECT_EQ(outcome.gpu_time, 700ns);
  EXPECT_FALSE(outcome.durable);
  EXPECT_EQ(world_.mask(entity_), 2);
  EXPECT_EQ(world_.engine.latest().version, 2u);
}

TEST_F(Statuses, WaitingForTheDeviceIsNotACost) {
  executor_takes(1ms);
  world_.executor.while_draining = [&] { world_.clock.advance(4ms); };
  for (int k = 0; k < 40; ++k) {
    const auto transaction = change(terms(DeadlineClass::soft, now_ + 1s));
    const Outcome& outcome = world_.execute(*transaction);
    EXPECT_EQ(outcome.published - outcome.started, 5ms);
    EXPECT_EQ(outcome.interrupted, 4ms);
    EXPECT_EQ(outcome.actual_cost, 1ms);
    EXPECT_TRUE(k < 39 || outcome.predicted_cost == 1ms);
    EXPECT_LE(outcome.gpu_time, outcome.actual_cost);
  }
}

TEST_F(Statuses, LateHasItsLateness) {
  executor_takes(5ms);
  for (const DeadlineClass deadline_class : {DeadlineClass::hard, DeadlineClass::soft}) {
    const auto transaction = change(terms(deadline_class, world_.clock.peek() + 2ms));
    const Outcome& outcome = world_.execute(*transaction);
    EXPECT_EQ(outcome.status, Status::late);
    EXPECT_TRUE(outcome.done());
    EXPECT_EQ(outcome.lateness, 3ms);
    EXPECT_EQ(world_.mask(entity_), 2);
  }
  EXPECT_EQ(world_.engine.counts().late, 2u);
  EXPECT_EQ(world_.engine.counts().hard_misses, 1u);
}

TEST_F(Statuses, MissedChangesNothing) {
  executor_takes(5ms);
  const auto transaction = change(terms(DeadlineClass::firm, now_ + 2ms));
  const Outcome& outcome = world_.execute(*transaction);
  EXPECT_EQ(outcome.status, Status::missed);
  EXPECT_FALSE(outcome.done());
  EXPECT_EQ(outcome.lateness, 3ms);
  EXPECT_EQ(outcome.actual_cost, 5ms);
  EXPECT_EQ(outcome.published, ClockTime{});
  EXPECT_EQ(outcome.version, 0u);
  EXPECT_EQ(world_.mask(entity_), 1);
  EXPECT_EQ(world_.engine.latest().version, 1u);
}

TEST_F(Statuses, MissedAtSubmissionIsNotStarted) {
  bool ran = false;
  world_.executor.work = [&](const auto&, const auto&, const auto&) {
    ran = true;
    return query::RunReport{};
  };
  const auto transaction = change(terms(DeadlineClass::firm, now_ - 1ms));
  const Outcome& outcome = world_.execute(*transaction);
  EXPECT_EQ(outcome.status, Status::missed);
  EXPECT_EQ(outcome.lateness, 1ms);
  EXPECT_EQ(outcome.started, ClockTime{});
  EXPECT_FALSE(ran);
}

TEST_F(Statuses, RefusedNamesTheEarliestFeasibleDeadline) {
  executor_takes(2ms);
  for (std::uint64_t k = 0; k < scheduler::CostModel::min_samples; ++k) {
    const auto transaction = change(terms(DeadlineClass::firm, world_.clock.peek() + 10ms));
    ASSERT_EQ(world_.execute(*transaction).status, Status::committed)
        << "nothing is refused before it is measured";
    EXPECT_EQ(transaction->outcome().predicted_cost, 0ns);
  }
  const auto tight = change(terms(DeadlineClass::firm, world_.clock.peek() + 1ms));
  const Outcome refused = world_.execute(*tight);
  EXPECT_EQ(refused.status, Status::refused);
  EXPECT_EQ(refused.predicted_cost, 2ms);
  EXPECT_EQ(refused.started, ClockTime{});
  EXPECT_EQ(refused.earliest_feasible, refused.submitted + 2250us) << "with an eighth for the resubmission";

  const auto feasible = change(terms(DeadlineClass::firm, refused.earliest_feasible));
  EXPECT_EQ(world_.execute(*feasible).status, Status::committed);
  const auto infeasible = change(terms(DeadlineClass::firm, world_.clock.peek() + 2ms - 1ns));
  EXPECT_EQ(world_.execute(*infeasible).status, Status::refused);
  for (const DeadlineClass never_refused : {DeadlineClass::hard, DeadlineClass::soft}) {
    const auto transaction = change(terms(never_refused, world_.clock.peek() + 1ms));
    EXPECT_EQ(world_.execute(*transaction).status, Status::late);
  }
}

TEST_F(Statuses, RefusedEndsWhenCostsFall) {
  executor_takes(2ms);
  for (std::uint64_t k = 0; k < 2 * scheduler::CostModel::min_samples; ++k) {
    world_.execute(*change(terms(DeadlineClass::soft)));
  }
  executor_takes(10us);
  int refused = 0;
  int submitted = 0;
  int committed_in_a_row = 0;
  for (; submitted < 5000 && committed_in_a_row < 100; ++submitted) {
    const auto transaction = change(terms(DeadlineClass::firm, world_.clock.peek() + 1ms));
    const Status status = world_.execute(*transaction).status;
    committed_in_a_row = status == Status::committed ? committed_in_a_row + 1 : 0;
    refused += status == Status::refused ? 1 : 0;
  }
  EXPECT_GT(refused, 0);
  EXPECT_GE(committed_in_a_row, 100) << "after " << submitted;
}

TEST_F(Statuses, RefusedDoesNotOccurUnderAVirtualClock) {
  world_.clock.virtual_time = true;
  executor_takes(2ms);
  for (int k = 0; k < 40; ++k) {
    const auto transaction = change(terms(DeadlineClass::soft));
    world_.execute(*transaction);
  }
  const auto tight = change(terms(DeadlineClass::firm, world_.clock.peek() + 1ms));
  EXPECT_EQ(world_.execute(*tight).status, Status::missed);
}

TEST_F(Statuses, ConflictNamesThePrecondition) {
  const auto writer = world_.make();
  writer->begin({});
  writer->expect_exists(entity_);
  writer->expect_written_by(entity_, 1);
  writer->update(entity_, row_of(7));
  ASSERT_EQ(world_.execute(*writer).status, Status::committed);

  writer->begin({});
  writer->expect_exists(entity_);
  writer->expect_written_by(entity_, 1);
  writer->update(entity_, row_of(8));
  const Outcome& outcome = world_.execute(*writer);
  EXPECT_EQ(outcome.status, Status::conflict);
  EXPECT_EQ(outcome.conflict.precondition, 1u);
  EXPECT_EQ(outcome.conflict.entity, entity_);
  EXPECT_TRUE(outcome.conflict.entity_exists);
  EXPECT_EQ(outcome.conflict.written_by, 2u);
  EXPECT_EQ(world_.mask(entity_), 7);

  writer->begin({});
  writer->expect_exists({entity_.index, entity_.generation + 1});
  EXPECT_EQ(world_.execute(*writer).status, Status::conflict);
  EXPECT_FALSE(writer->outcome().conflict.entity_exists);

  Terms earlier = terms(DeadlineClass::soft);
  earlier.read_at = ReadAt::pinned(1);
  writer->begin(earlier);
  writer->expect_written_by(entity_, 1);
  EXPECT_EQ(world_.execute(*writer).status, Status::committed)
      << "a reader's preconditions are checked in the version that it reads";
  EXPECT_EQ(world_.engine.counts().conflicts, 2u);
}

TEST_F(Statuses, TruncatedIsDone) {
  executor_takes(1us, query::RunStatus::truncated);
  const auto in_time = change(terms(DeadlineClass::firm, now_ + 1ms));
  EXPECT_EQ(world_.execute(*in_time).status, Status::truncated);
  EXPECT_TRUE(in_time->outcome().done());
  EXPECT_EQ(world_.mask(entity_), 2);
  executor_takes(2ms, query::RunStatus::truncated);
  const auto late = change(terms(DeadlineClass::soft, now_ + 1ms));
  EXPECT_EQ(world_.execute(*late).status, Status::late);
  EXPECT_TRUE(late->outcome().truncated);
}

TEST_F(Statuses, BadInputInAWriteChangesNothing) {
  const auto transaction = world_.make();
  transaction->begin({});
  transaction->update(entity_, row_of(5));
  Motion motion;
  motion.p_world_m.y = std::nan("");
  transaction->update_motion(entity_, motion);
  transaction->create(row_of(6));
  const Outcome& outcome = world_.execute(*transaction);
  EXPECT_EQ(outcome.status, Status::bad_input);
  EXPECT_EQ(outcome.bad_input.reason, BadInputReason::not_finite);
  EXPECT_EQ(outcome.bad_input.element, 1u);
  EXPECT_EQ(outcome.bad_query, -1);
  EXPECT_EQ(world_.mask(entity_), 1);
  EXPECT_FALSE(transaction->created(0).valid());
}

TEST_F(Statuses, BadInputInAQueryDiscardsTheWrites) {
  Terms later = terms(DeadlineClass::soft);
  later.world_time = world_time_ns(100);
  SimulatedQuery other(4);
  for (Ray& ray : other.rays())
    ray.t = world_time_ns(100);
  other.rays()[2].t = world_time_ns(99);
  query_.rays()[0].t = world_time_ns(100);

  const auto transaction = world_.make();
  transaction->begin(later);
  transaction->update(entity_, row_of(5));
  transaction->add_query(query_, 1);
  transaction->add_query(other, 3);
  const Outcome& outcome = world_.execute(*transaction);
  EXPECT_EQ(outcome.bad_input.reason, BadInputReason::time_not_covered);
  EXPECT_EQ(outcome.bad_query, 1);
  EXPECT_EQ(outcome.bad_input.element, 2u);
  EXPECT_EQ(world_.mask(entity_), 1);
}

TEST_F(Statuses, BadInputInTimesTooFarApart) {
  const auto run = [&](WorldTime last) {
    query_.rays()[0].t = WorldTime{};
    query_.rays()[1].t = last;
    return world_.execute(begin_query(*world_.make(), query_, {}, 2));
  };
  EXPECT_EQ(run(world_time_ns(max_query_window_ns)).status, Status::committed);
  const Outcome refused = run(world_time_ns(max_query_window_ns + 1));
  EXPECT_EQ(refused.bad_input.reason, BadInputReason::window_too_long);
  EXPECT_DOUBLE_EQ(refused.bad_input.values[1], 1.000000001);
  EXPECT_EQ(run(WorldTime::max()).status, Status::bad_input);
}

TEST_F(Statuses, CommittedWithoutElementsOrOperations) {
  std::optional<store::TimeSpan> span;
  world_.executor.work = [&](const auto&, const auto&, const store::TimeSpan& times) {
    span = times;
    return query::RunReport{};
  };
  const auto transaction = world_.make();
  transaction->begin({});
  transaction->add_query(query_, 0);
  EXPECT_EQ(world_.execute(*transaction).status, Status::committed);
  ASSERT_TRUE(span) << "the executor runs also when the batch has no element";
  EXPECT_EQ(span->first, WorldTime{});
  EXPECT_EQ(span->last, WorldTime{});
  transaction->begin({});
  EXPECT_EQ(world_.execute(*transaction).status, Status::committed) << "an empty transaction";
  EXPECT_EQ(transaction->outcome().version, 1u);
}

TEST(MisuseDeathTest, OfADeclaredTransactionAborts) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  World world;
  const auto transaction = world.make(1, 1);
  SimulatedQuery query(2);
  transaction->begin({});
  transaction->create(row_of(1));
  EXPECT_DEATH(transaction->create(row_of(2)), "Transaction::create: more writes than .*max_writes");
  EXPECT_DEATH(transaction->add_query(query, 3),
               "Transaction::add_query: more elements than the query's capacity");
  transaction->add_query(query, 2);
  EXPECT_DEATH(transaction->add_query(query, 2), "Transaction::add_query: more queries than .*max_queries");
  const auto twice = world.make(1, 2);
  twice->begin({});
  twice->add_query(query, 1);
  EXPECT_DEATH(twice->add_query(query, 1), "Transaction::add_query: the query is in the transaction already");
  EXPECT_DEATH(world.engine.wait(*transaction), "Database::wait: the transaction was not submitted");
  EXPECT_DEATH(static_cast<void>(transaction->created(0)),
               "Transaction::created: the transaction was not submitted");
  world.execute(*transaction);
  EXPECT_DEATH(world.engine.submit(*transaction), "Database::submit: .*call Transaction::begin");
  EXPECT_DEATH(transaction->create(row_of(1)), "Transaction::create: .*call Transaction::begin");
  EXPECT_DEATH(static_cast<void>(transaction->created(1)), "Transaction::created: the ordinal is not one");
  Terms beyond;
  beyond.importance = max_importance + 1;
  EXPECT_DEATH(transaction->begin(beyond), "max_importance");
  World other;
  transaction->begin({});
  EXPECT_DEATH(other.engine.submit(*transaction),
               "Database::submit: the transaction was made by another database");
}

TEST(MisuseDeathTest, OfATransactionThatWasNeverBegunAborts) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  World world;
  SimulatedQuery query(1);
  const auto transaction = world.engine.make_transaction(
      {.max_writes = 1, .max_preconditions = 1, .max_queries = 1, .max_reads = 1, .max_geometry_updates = 1});
  Transaction& never = *transaction;
  const std::string fault = ": the transaction was never begun; call Transaction::begin first";
  EXPECT_DEATH(never.create(row_of(1)), "Transaction::create" + fault);
  EXPECT_DEATH(never.update(EntityId{}, row_of(1)), "Transaction::update" + fault);
  EXPECT_DEATH(never.update_motion(EntityId{}, Motion{}), "Transaction::update_motion" + fault);
  EXPECT_DEATH(never.remove(EntityId{}), "Transaction::remove" + fault);
  EXPECT_DEATH(never.update_geometry(GeometryId{}, {}), "Transaction::update_geometry" + fault);
  EXPECT_DEATH(never.expect_exists(EntityId{}), "Transaction::expect_exists" + fault);
  EXPECT_DEATH(never.expect_written_by(EntityId{}, 1), "Transaction::expect_written_by" + fault);
  EXPECT_DEATH(static_cast<void>(never.read(EntityId{})), "Transaction::read" + fault);
  EXPECT_DEATH(never.add_query(query, 1), "Transaction::add_query" + fault);
  EXPECT_DEATH(world.engine.submit(never), "Database::submit" + fault);
  EXPECT_DEATH(static_cast<void>(world.engine.calibrate(never)), "Database::calibrate" + fault);
}

TEST(Begin, DiscardsEarlierDeclarations) {
  World world;
  const auto transaction = world.make(1, 0);
  transaction->begin({});
  transaction->create(row_of(1));
  transaction->begin({});
  EXPECT_EQ(world.execute(*transaction).version, 0u);
}

}  // namespace
}  // namespace rtstdb::transaction::test
