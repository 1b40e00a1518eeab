// Eight threads submit transactions of all deadline classes and late policies, with reservations, short and
// long queries and cancellations. The thread sanitizer looks for races; the test checks the outcomes.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <random>
#include <thread>

#include "rtstdb/transaction/monotonic_clock.hpp"
#include "tests/support/simulation/engine.hpp"

namespace hil::long_test {
namespace {

using namespace std::chrono_literals;
using namespace rtstdb;
using namespace rtstdb::transaction::test;

constexpr std::size_t clients = 8;
constexpr int rounds_each = 200;
constexpr std::uint32_t entities = 32;

class ConcurrentSubmissions : public testing::Test {
 protected:
  ConcurrentSubmissions() {
    executor_.work = [this](const store::RowSource& rows, std::span<const query::Request>,
                            const store::TimeSpan&) {
      std::uint64_t sum = 0;
      for (std::uint32_t index = 0; index < rows.index_limit(); ++index)
        sum += rows.row(index) != nullptr ? rows.row(index)->row.mask : 0;
      mask_sum_ = sum;
      return query::RunReport{};
    };
    executor_.chunk = [this](const store::RowSource&, const query::Request&, std::uint32_t first,
                             std::uint32_t end) {
      const ClockTime until = clock_.now() + Nanoseconds(20) * (end - first);
      while (clock_.now() < until) {
      }
    };
    const auto creation = engine_.make_transaction({.max_writes = entities});
    creation->begin({});
    for (std::uint32_t k = 0; k < entities; ++k)
      creation->create(row_of(0));
    engine_.submit(*creation);
    engine_.wait(*creation);
    for (std::size_t k = 0; k < clients; ++k) {
      for (auto& transaction : transactions_[k])
        transaction = engine_.make_transaction({.max_writes = 4, .max_queries = 2});
      constexpr LatePolicy policies[] = {LatePolicy::discard, LatePolicy::last_good, LatePolicy::partial};
      for (std::size_t q = 0; q < queries_[k].size(); ++q) {
        queries_[k][q] = std::make_unique<SimulatedQuery>(4 * 4096, 0, query::CostClass::ray_closest,
                                                          policies[(k + q) % 3]);
      }
    }
  }

  void run_client(std::size_t self) {
    std::minstd_rand random(static_cast<unsigned>(self) + 1);
    std::unique_ptr<Reservation> reservation;
    for (int round = 0; round < rounds_each; ++round) {
      if (self < 4 && round % 50 == 0) {
        reservation.reset();
        auto made = engine_.reserve({.name = "r" + std::to_string(self),
                                     .period = 20ms,
                                     .deadline = 20ms,
                                     .budget = 1ms,
                                     .writes_and_queries = self == 3});
        if (made) reservation = std::move(made).value();
      }
      for (std::size_t k = 0; k < transactions_[self].size(); ++k)
        submit(*transactions_[self][k], self, k, reservation.get(), random);
      if (random() % 4 == 0) engine_.cancel(*transactions_[random() % clients][random() % 2]);
      for (const auto& transaction : transactions_[self])
        check(engine_.wait(*transaction), *transaction);
      for (const auto& one : queries_[self])
        wrong_ += one->hits().size() != one->answer_info().elements;
    }
  }

  void submit(Transaction& transaction, std::size_t self, std::size_t k, Reservation* reservation,
              std::minstd_rand& random) {
    Terms given =
        terms(static_cast<DeadlineClass>(random() % 4), clock_.now() + Nanoseconds(random() % 5'000'000),
              static_cast<std::uint8_t>(random() % 3));
    if (reservation != nullptr && random() % 4 == 0) {
      given.reservation = reservation;
      given.deadline = ClockTime::max();
    }
    transaction.begin(given);
    const bool writes = random() % 3 == 0;
    if (writes)
      transaction.update({static_cast<std::uint32_t>(random() % entities), 1},
                         row_of(static_cast<std::uint32_t>(random() % 100)));
    if (!writes || random() % 2 == 0)
      transaction.add_query(*queries_[self][k],
                            1 + static_cast<std::uint32_t>(random() % 8 == 0 ? 3 * 4096 : random() % 200));
    engine_.submit(transaction);
  }

  void check(const Outcome& outcome, const Transaction& transaction) {
    using enum Status;
    ++ended_;
    done_ += outcome.done();
    constexpr Status valid[] = {committed, truncated, late, missed, refused, cancelled};
    wrong_ += std::ranges::find(valid, outcome.status) == std::end(valid);
    wrong_ += transaction.status() != outcome.status;
    wrong_ += outcome.status == Status::missed && outcome.lateness <= 0ns;
  }

  const transaction::MonotonicClock clock_;
  SimulatedExecutor executor_;
  static transaction::EngineOptions options() {
    transaction::EngineOptions made = engine_options(8, entities, 4096);
    made.spin = 20us;
    return made;
  }
  std::array<std::array<std::unique_ptr<SimulatedQuery>, 2>, clients> queries_;
  std::atomic<std::uint64_t> mask_sum_{0}, ended_{0}, done_{0}, wrong_{0};
  transaction::Engine engine_{options(), executor_, clock_};
  std::array<std::array<std::unique_ptr<Transaction>, 2>, clients> transactions_;
};

TEST_F(ConcurrentSubmissions, EachTransactionHasOneValidOutcome) {
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < clients; ++k)
    threads.emplace_back([this, k] { run_client(k); });
  std::thread reader([this] {
    while (ended_ < clients * rounds_each * 2) {
      for (const ReservationCounts& one : engine_.scheduler_counts().reservations)
        wrong_ += one.kept + one.broken + one.too_long > one.transactions + 2;
      EXPECT_TRUE(engine_.snapshot(ReadAt::latest()).ok());
    }
  });
  for (std::thread& thread : threads)
    thread.join();
  reader.join();
  EXPECT_EQ(wrong_, 0u);
  EXPECT_EQ(ended_, clients * rounds_each * 2u);
  EXPECT_GT(done_, 100u);
  const TransactionCounts counts = engine_.counts();
  EXPECT_EQ(counts.firm_late_commits, 0u);
  EXPECT_EQ(counts.submitted, counts.committed + counts.truncated + counts.late + counts.missed +
                                  counts.refused + counts.cancelled);
}

}  // namespace
}  // namespace hil::long_test
