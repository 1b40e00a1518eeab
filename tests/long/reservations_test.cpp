// Transactions that keep to their reservations meet their deadlines at three times the load that the device
// can execute.

#include <gtest/gtest.h>

#include <iostream>
#include <map>

#include "tests/long/simulated_load.hpp"
#include "tests/support/rounds.hpp"

namespace hil::long_test {
namespace {

using namespace std::chrono_literals;
using rtstdb::DeadlineClass;
using rtstdb::ReservationCounts;
using rtstdb::Status;

const std::uint64_t transactions = tests::rounds(40'000, 3'000'000);

struct ReservedStream {
  rtstdb::ReservationOptions options;
  std::uint32_t elements = 0, rows = 0;
};

/// The budgets hold the largest cost: 1.3 us for an element, submissions, and readings of the clock.
const std::vector<ReservedStream> reserved_streams{
    {{.name = "control", .period = 5ms, .deadline = 5ms, .budget = 500us}, 300, 0},
    {{.name = "move", .period = 10ms, .deadline = 8ms, .budget = 100us}, 0, 4},
    {{.name = "scan", .period = 40ms, .deadline = 40ms, .budget = 9ms}, 6000, 0},
    {{.name = "contact", .period = 20ms, .deadline = 18ms, .budget = 1ms, .writes_and_queries = true},
     500,
     2}};

struct Results {
  std::map<std::string, std::uint64_t> ended, missed;
  std::vector<ReservationCounts> counts;
  std::uint64_t restarts = 0;
};

Results run(bool reserved) {
  SimulatedLoad load({.seed = 1, .cost_spread = 0.3});
  // Soft transactions of any importance, with earlier deadlines than the reserved ones.
  const auto soft = streams_of({.at_random = true,
                                .deadline_class = DeadlineClass::soft,
                                .min_deadline = 1ns,
                                .max_deadline = 2ms,
                                .max_importance = rtstdb::max_importance},
                               {{"short", 400us, 10, 400},
                                {"long", 10ms, 3000, 20'000},
                                {"write", 500us, 0, 0, 2},
                                {"write and query", 2ms, 0, 1000, 2},
                                {"write and long query", 10ms, 3000, 20'000, 2}});
  EXPECT_NEAR(load_of(soft), 3.0, 0.3);
  for (const Stream& stream : soft)
    load.add(stream);
  load.run(500);  // until the cost model has estimates
  std::vector<std::unique_ptr<rtstdb::Reservation>> reservations;
  for (const ReservedStream& one : reserved_streams) {
    Stream stream{.name = one.options.name,
                  .period = one.options.period,
                  .deadline_class = DeadlineClass::hard,
                  .min_deadline = one.options.deadline,
                  .max_deadline = one.options.deadline,
                  .min_importance = rtstdb::max_importance,
                  .max_importance = rtstdb::max_importance,
                  .min_elements = one.elements,
                  .max_elements = one.elements,
                  .rows = one.rows};
    if (reserved) {
      auto made = load.engine().reserve(one.options);
      if (!made) {
        ADD_FAILURE() << made.error().message;
        return {};
      }
      reservations.push_back(std::move(made).value());
      stream.reservation = reservations.back().get();
    }
    load.add(stream);
  }
  Results results;
  load.run(transactions, [&](const CompletedTransaction& one) {
    if (one.stream->deadline_class != DeadlineClass::hard) return;
    ++results.ended[one.stream->name];
    results.missed[one.stream->name] += one.transaction->status() != Status::committed;
  });
  results.counts = load.engine().scheduler_counts().reservations;
  results.restarts = load.engine().scheduler_counts().restarts;
  return results;
}

TEST(Reservations, AreKeptAtThreefoldLoad) {
  const Results results = run(true);
  ASSERT_EQ(results.counts.size(), reserved_streams.size());
  for (const ReservationCounts& counts : results.counts) {
    const std::string& name = counts.options.name;
    std::cout << name << ": " << counts.transactions << " kept, longest response "
              << counts.longest_response.count() / 1000 << " us of " << counts.options.deadline.count() / 1000
              << ", largest cost " << counts.largest_cost.count() / 1000 << " us of "
              << counts.options.budget.count() / 1000 << "\n";
    EXPECT_GT(results.ended.at(name), transactions / 400) << name;
    EXPECT_EQ(results.missed.at(name), 0u) << name;
    EXPECT_EQ(counts.kept, counts.transactions) << name;
    EXPECT_EQ(counts.transactions, results.ended.at(name)) << name;
    EXPECT_EQ(counts.broken + counts.too_often + counts.too_long + counts.undeclared, 0u) << name;
  }
  EXPECT_GT(results.restarts, transactions / 400) << "of writers in favour of reserved transactions";
}

TEST(Reservations, AreNecessaryAtThisLoad) {
  std::uint64_t missed = 0;
  for (const auto& [name, count] : run(false).missed)
    missed += count;
  EXPECT_GT(missed, transactions / 400);
}

}  // namespace
}  // namespace hil::long_test
