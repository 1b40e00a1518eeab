// Of the firm transactions that admission accepts by their predicted cost, at least 99.9 % complete in time,
// under random costs and more load than the device can execute.

#include <gtest/gtest.h>

#include <iostream>

#include "tests/long/simulated_load.hpp"
#include "tests/support/rounds.hpp"

namespace hil::long_test {
namespace {

using namespace std::chrono_literals;
using rtstdb::DeadlineClass;

const std::uint64_t transactions = tests::rounds(60'000, 3'000'000);

struct Conditions {
  const char* name;
  LoadOptions options;
  bool with_reservation;
};

class Admission : public testing::TestWithParam<Conditions> {};

TEST_P(Admission, KeepsItsPromises) {
  SimulatedLoad load(GetParam().options);
  const auto streams = streams_of(
      {.at_random = true, .deadline_class = DeadlineClass::firm, .min_deadline = 100us, .max_deadline = 30ms},
      {{"short", 500us, 1, 600},
       {"write", 2ms, 0, 0, 3},
       {"write and query", 2ms, 1, 800, 2},
       {"long", 20ms, 2000, 20'000}});
  EXPECT_GT(load_of(streams), 1.2);
  for (const Stream& stream : streams)
    load.add(stream);
  load.run(2000);
  std::unique_ptr<rtstdb::Reservation> reservation;
  if (GetParam().with_reservation) {
    reservation =
        std::move(load.engine().reserve({.name = "r", .period = 8ms, .deadline = 8ms, .budget = 1500us}))
            .value();
    load.add({.name = "reserved",
              .period = 8ms,
              .deadline_class = DeadlineClass::hard,
              .reservation = reservation.get(),
              .min_deadline = 8ms,
              .max_deadline = 8ms,
              .min_elements = 800,
              .max_elements = 1000});
  }
  const rtstdb::SchedulerCounts before = load.engine().scheduler_counts();
  load.run(transactions);
  const rtstdb::SchedulerCounts counts = load.engine().scheduler_counts();
  const std::uint64_t promised = counts.promised - before.promised;
  const std::uint64_t kept = counts.kept - before.kept;
  std::cout << promised << " promised, " << kept << " kept, " << load.engine().counts().refused
            << " refused; predicted over actual cost:\n";
  for (const rtstdb::CostPredictions& one : counts.predictions) {
    std::cout << "  " << one.cost_class << ": 1 % below " << one.p01 << ", median " << one.median
              << ", 1 % above " << one.p99 << " (" << one.count << ")\n";
    EXPECT_NEAR(one.median, 1.0, 0.1) << one.cost_class;
  }
  EXPECT_GT(promised, transactions / 4);
  EXPECT_GE(static_cast<double>(kept), 0.999 * static_cast<double>(promised));
  EXPECT_GT(load.engine().counts().refused, transactions / 100);
  EXPECT_TRUE(!reservation || reservation->counts().broken == 0);
}

INSTANTIATE_TEST_SUITE_P(
    Costs, Admission,
    testing::Values(Conditions{"Random", {.seed = 11, .cost_spread = 0.3}, false},
                    Conditions{"SomeFourTimesAsExpensive",
                               {.seed = 12, .cost_spread = 0.2, .expensive_batch_one_in = 1000},
                               false},
                    Conditions{"WithAReservation", {.seed = 13, .cost_spread = 0.3}, true}),
    [](const auto& conditions) { return conditions.param.name; });

}  // namespace
}  // namespace hil::long_test
