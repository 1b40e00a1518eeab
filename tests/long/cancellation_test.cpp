// A transaction is cancelled at every reading of the clock: while it waits, runs, is preempted, shares a run,
// restarts or is published. It has one outcome, and its writes are as the outcome says.

#include <gtest/gtest.h>

#include <array>

#include "tests/support/rounds.hpp"
#include "tests/support/simulation/engine.hpp"

namespace hil::long_test {
namespace {

using namespace std::chrono_literals;
using namespace rtstdb;
using namespace rtstdb::transaction::test;

constexpr std::uint32_t chunk = 4096;

/// A writer with a query preempts a long batch, a reserved transaction makes the writer restart, and two
/// small readers share a run.
class Scenario {
 public:
  enum Role : std::size_t { batch, writer, reserved, first_reader, second_reader, count };

  Scenario() {
    world_.executor.chunk = [this](const auto&, const query::Request& request, std::uint32_t first,
                                   std::uint32_t end) {
      world_.clock.advance(500us * (end - first) / chunk);
      chunk_done(request, first);
    };
    for (std::size_t k = 0; k < count; ++k) {
      queries_.push_back(std::make_unique<SimulatedQuery>(8 * chunk, static_cast<int>(k)));
      made_.push_back(world_.make());
      entities_.push_back(world_.create(0));
    }
    // Until the cost model has estimates.
    for (std::uint32_t k = 0; k < 40; ++k) {
      declare(batch, {}, chunk * (1 + k % 4));
      world_.execute(*made_[batch]);
    }
    reservation_ =
        std::move(
            world_.engine.reserve(
                {.name = "r", .period = 100ms, .deadline = 20ms, .budget = 2ms, .writes_and_queries = true}))
            .value();
  }

  /// Cancels one transaction at a reading of the clock. Returns whether it was cancelled.
  bool run(Role role, int reading) {
    submitted_ = {};
    world_.clock.advance(200ms);
    declare(batch, terms(DeadlineClass::soft), 6 * chunk);
    world_.clock.call_at_reading(reading, [&] {
      if (made_[role]->status() == Status::pending) world_.engine.cancel(*made_[role]);
    });
    world_.engine.submit(*made_[batch]);
    bool cancelled = false;
    world_.engine.wait(*made_[batch]);
    for (std::size_t k = 0; k < count; ++k) {
      if (k != batch && !submitted_[k]) continue;  // after a cancelled transaction
      const Status status = world_.engine.wait(*made_[k]).status;
      const bool committed = status == Status::committed;
      EXPECT_TRUE(committed || (status == Status::cancelled && k == role))
          << to_string(status) << ", role " << k;
      cancelled = cancelled || !committed;
      const bool writes = k == writer || k == reserved;
      EXPECT_EQ(world_.mask(entities_[k]) == rounds_, committed && writes) << "role " << k;
      restarts += made_[k]->outcome().restarts;
    }
    world_.clock.call_at_reading(0, {});
    ++rounds_;
    return cancelled;
  }
  TransactionCounts counts() { return world_.engine.counts(); }

  std::uint64_t restarts = 0;

 private:
  void declare(Role role, const Terms& given, std::uint32_t elements) {
    made_[role]->begin(given);
    if (role == writer || role == reserved) made_[role]->update(entities_[role], row_of(rounds_));
    made_[role]->add_query(*queries_[role], elements);
  }
  void submit(Role role, const Terms& given, std::uint32_t elements) {
    declare(role, given, elements);
    world_.engine.submit(*made_[role]);
    submitted_[role] = true;
  }
  void chunk_done(const query::Request& request, std::uint32_t first) {
    if (!reservation_ || first == 0) return;
    if (request.query == queries_[batch].get() && !submitted_[writer])
      submit(writer, terms(DeadlineClass::soft, ClockTime::max(), 1), 6 * chunk);
    if (request.query == queries_[writer].get() && !submitted_[reserved]) {
      Terms hard = terms(DeadlineClass::hard);
      hard.reservation = reservation_.get();
      submit(reserved, hard, chunk);
      submit(first_reader, terms(DeadlineClass::soft, ClockTime::max(), 2), 100);
      submit(second_reader, terms(DeadlineClass::soft, ClockTime::max(), 2), 100);
    }
  }

  World world_{engine_options(16, 64, 4096)};
  std::vector<std::unique_ptr<SimulatedQuery>> queries_;
  std::vector<std::unique_ptr<Transaction>> made_;
  std::vector<EntityId> entities_;
  std::unique_ptr<Reservation> reservation_;
  std::array<bool, count> submitted_{};
  std::uint32_t rounds_ = 1;
};

TEST(Cancellation, GivesOneOutcomeAtEveryReadingOfTheClock) {
  Scenario scenario;
  constexpr std::uint64_t readings = 90;
  const std::uint64_t runs = tests::rounds(2 * readings, 100 * readings);
  for (std::size_t role = 0; role < Scenario::count; ++role) {
    std::uint64_t cancelled = 0;
    for (std::uint64_t k = 0; k < runs; ++k) {
      const auto reading = static_cast<int>(1 + (k * 7) % readings);
      SCOPED_TRACE(testing::Message() << "role " << role << " at reading " << reading);
      cancelled += scenario.run(static_cast<Scenario::Role>(role), reading) ? 1 : 0;
      ASSERT_FALSE(HasFailure());
    }
    EXPECT_GT(cancelled, runs / 30) << "role " << role;
    EXPECT_LT(cancelled, runs - runs / 30) << "role " << role;
  }
  EXPECT_GT(scenario.restarts, runs / 4);
  const TransactionCounts counts = scenario.counts();
  EXPECT_EQ(counts.submitted, counts.committed + counts.cancelled);
}

}  // namespace
}  // namespace hil::long_test
