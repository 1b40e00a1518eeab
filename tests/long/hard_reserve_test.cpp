// hard-reserve: whatever else comes, reserved transactions that keep to their reservations are done when they
// are due.

#include <gtest/gtest.h>

#include <iostream>
#include <map>

#include "tests/long/simulated_load.hpp"
#include "tests/support/rounds.hpp"

namespace hil::stress {
namespace {

using namespace std::chrono_literals;
using rtstdb::DeadlineClass;
using rtstdb::ReservationCounts;
using rtstdb::Status;

const std::uint64_t transactions = tests::rounds(40'000, 3'000'000);

/// Three times what can be done: short and long readers, writers, and writers that ask; all soft, most
/// important and with deadlines that lie before all others.
std::vector<Stream> flood() {
  const Stream soft{.at_random = true,
                    .deadline_class = DeadlineClass::soft,
                    .shortest_deadline = 1ns,
                    .longest_deadline = 2ms,
                    .min_importance = 0,
                    .max_importance = rtstdb::max_importance};
  std::vector<Stream> streams(5, soft);
  const char* const names[] = {"short", "long", "write", "write and ask", "write and ask long"};
  for (std::size_t k = 0; k < streams.size(); ++k)
    streams[k].name = names[k];
  streams[0].period = 400us;
  streams[0].fewest_elements = 10;
  streams[0].max_elements = 400;
  streams[1].period = 10ms;
  streams[1].fewest_elements = 3000;
  streams[1].max_elements = 20'000;
  streams[2].period = 500us;
  streams[2].rows = 2;
  streams[3].period = 2ms;
  streams[3].rows = 2;
  streams[3].max_elements = 1000;
  streams[4].period = 10ms;
  streams[4].rows = 2;
  streams[4].fewest_elements = 3000;
  streams[4].max_elements = 20'000;
  return streams;
}

struct Hard {
  rtstdb::ReservationOptions options;
  std::uint32_t elements = 0, rows = 0;
};

/// Budgets hold the dearest of what they cost: 1.3 us for an element, and what submissions and readings of
/// the clock take.
const std::vector<Hard>& hard() {
  static const std::vector<Hard> all{
      {{.name = "control", .period = 5ms, .deadline = 5ms, .budget = 500us}, 300, 0},
      {{.name = "move", .period = 10ms, .deadline = 8ms, .budget = 100us}, 0, 4},
      {{.name = "scan", .period = 40ms, .deadline = 40ms, .budget = 9ms}, 6000, 0},
      {{.name = "contact", .period = 20ms, .deadline = 18ms, .budget = 1ms, .writes_and_queries = true},
       500,
       2}};
  return all;
}

struct Judged {
  std::map<std::string, std::uint64_t> came, missed;
  std::vector<ReservationCounts> counts;
  std::uint64_t restarts = 0;
};

Judged run(bool reserved, std::uint64_t seed) {
  SimulatedLoad load({.seed = seed, .spread = 0.3});
  const std::vector<Stream> soft = flood();
  EXPECT_NEAR(load_of(soft), 3.0, 0.3);
  for (const Stream& stream : soft)
    load.add(stream);
  // Costs have to be known, and with them how batches are divided.
  load.run(500, [](const Ended&) {});
  std::vector<std::unique_ptr<rtstdb::Reservation>> reservations;
  for (const Hard& one : hard()) {
    Stream stream{.name = one.options.name,
                  .period = one.options.period,
                  .deadline_class = DeadlineClass::hard,
                  .shortest_deadline = one.options.deadline,
                  .longest_deadline = one.options.deadline,
                  .min_importance = rtstdb::max_importance,
                  .max_importance = rtstdb::max_importance,
                  .fewest_elements = one.elements,
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
  Judged judged;
  load.run(transactions, [&](const Ended& one) {
    if (one.stream->deadline_class != DeadlineClass::hard) return;
    ++judged.came[one.stream->name];
    judged.missed[one.stream->name] += one.transaction->status() != Status::committed;
  });
  judged.counts = load.engine().scheduler_counts().reservations;
  judged.restarts = load.engine().scheduler_counts().restarts;
  return judged;
}

TEST(HardReserve, NoneIsMissedInAFloodOfThreeTimesWhatCanBeDone) {
  const Judged judged = run(true, 1);
  ASSERT_EQ(judged.counts.size(), hard().size());
  for (const ReservationCounts& counts : judged.counts) {
    const std::string& name = counts.options.name;
    std::cout << name << ": " << counts.transactions << " kept, longest answer "
              << counts.longest_response.count() / 1000 << " us of " << counts.options.deadline.count() / 1000
              << ", largest cost " << counts.largest_cost.count() / 1000 << " us of "
              << counts.options.budget.count() / 1000 << "\n";
    EXPECT_GT(judged.came.at(name), transactions / 400) << name;
    EXPECT_EQ(judged.missed.at(name), 0u) << name;
    EXPECT_EQ(counts.kept, counts.transactions) << name;
    EXPECT_EQ(counts.transactions, judged.came.at(name)) << name;
    EXPECT_EQ(counts.broken + counts.too_often + counts.too_long + counts.undeclared, 0u) << name;
  }
  std::cout << judged.restarts << " begun anew\n";
  EXPECT_GT(judged.restarts, transactions / 400) << "or writers did not stand in the way";
}

TEST(HardReserve, WithoutReservationsTheFloodMakesThemMiss) {
  const Judged judged = run(false, 1);
  std::uint64_t missed = 0;
  for (const auto& [name, count] : judged.missed)
    missed += count;
  EXPECT_GT(missed, transactions / 400) << "or it was no flood";
}

}  // namespace
}  // namespace hil::stress
