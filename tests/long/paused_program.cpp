// The program that paused_test.cpp stops and continues: a firm transaction every millisecond, on the
// machine's clock, while the standard input is open. Then it prints the counts of their outcomes.

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include "rtstdb/transaction/monotonic_clock.hpp"
#include "tests/support/simulation/engine.hpp"

namespace {

using namespace std::chrono_literals;
using namespace rtstdb;
using namespace rtstdb::transaction::test;

bool input_is_open() {
  pollfd input{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  return poll(&input, 1, 0) == 0;
}

}  // namespace

int main() {
  const transaction::MonotonicClock clock;
  SimulatedExecutor executor;
  executor.work = [&](const auto&, const auto&, const auto&) {
    const ClockTime until = clock.now() + 50us;
    while (clock.now() < until) {
    }
    return query::RunReport{};
  };
  transaction::Engine engine(engine_options(), executor, clock);
  SimulatedQuery query(4);
  const auto transaction = engine.make_transaction(room_for(1, 0, 1));
  transaction->begin({});
  const auto ordinal = transaction->create(row_of(1));
  engine.submit(*transaction);
  engine.wait(*transaction);
  const EntityId entity = transaction->created(ordinal);
  unsigned long committed = 0;
  unsigned long missed = 0;
  unsigned long late_commits = 0;
  unsigned long false_misses = 0;
  Nanoseconds longest_pause{0};
  Nanoseconds max_lateness{0};
  std::puts("ready");
  std::fflush(stdout);
  ClockTime last = clock.now();
  while (input_is_open()) {
    const ClockTime deadline = clock.now() + 20ms;
    transaction->begin(terms(DeadlineClass::firm, deadline));
    transaction->update(entity, row_of(2));
    transaction->add_query(query, 4);
    engine.submit(*transaction);
    const Outcome& outcome = engine.wait(*transaction);
    const ClockTime now = clock.now();
    committed += outcome.done();
    missed += outcome.status == Status::missed;
    late_commits += outcome.done() && outcome.published > deadline;
    false_misses +=
        outcome.status == Status::missed && (outcome.lateness <= 0ns || now - deadline < outcome.lateness);
    max_lateness = std::max(max_lateness, outcome.lateness);
    longest_pause = std::max(longest_pause, now - last);
    last = now;
    std::this_thread::sleep_for(1ms);
  }
  late_commits += engine.counts().firm_late_commits;
  std::printf(
      "committed %lu missed %lu late_commits %lu false_misses %lu longest_pause_ms %lld max_lateness_ms "
      "%lld\n",
      committed, missed, late_commits, false_misses, static_cast<long long>(longest_pause / 1ms),
      static_cast<long long>(max_lateness / 1ms));
  return 0;
}
