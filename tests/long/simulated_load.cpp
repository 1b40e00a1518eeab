#include "tests/long/simulated_load.hpp"

#include <algorithm>
#include <utility>

namespace hil::long_test {

using namespace std::chrono_literals;
using rtstdb::Status;
using rtstdb::transaction::test::row_of;
using rtstdb::transaction::test::SimulatedQuery;

std::vector<Stream> streams_of(const Stream& common, std::initializer_list<Demand> demands) {
  std::vector<Stream> streams;
  for (const Demand& demand : demands) {
    Stream& stream = streams.emplace_back(common);
    stream.name = demand.name;
    stream.period = demand.period;
    stream.min_elements = demand.min_elements;
    stream.max_elements = demand.max_elements;
    stream.rows = demand.rows;
  }
  return streams;
}

double load_of(std::span<const Stream> streams) {
  double sum = 0.0;
  for (const Stream& stream : streams) {
    const double elements = 0.5 * (stream.min_elements + stream.max_elements);
    sum += elements * 1000.0 / static_cast<double>(stream.period.count());
  }
  return sum;
}

struct SimulatedLoad::Slot {
  std::unique_ptr<rtstdb::Transaction> transaction;
  std::unique_ptr<SimulatedQuery> query;
  ClockTime deadline{};
  ClockTime cancel_at = ClockTime::max();
  bool used = false;
};

struct SimulatedLoad::StreamState {
  Stream stream;
  std::vector<Slot> slots;
  std::size_t next = 0;
  ClockTime next_arrival{};
};

SimulatedLoad::SimulatedLoad(const LoadOptions& options)
    : options_(options),
      random_(options.seed),
      world_(rtstdb::transaction::test::engine_options(options.queue_capacity, entities, 1u << 16), *this) {
  world_.clock.per_reading_ns = options.time_per_reading.count();
  const auto creation = world_.engine.make_transaction({.max_writes = entities});
  creation->begin({});
  for (std::uint32_t k = 0; k < entities; ++k)
    creation->create(row_of(0));
  world_.engine.submit(*creation);
  world_.engine.wait(*creation);
}

SimulatedLoad::~SimulatedLoad() = default;

void SimulatedLoad::add(const Stream& stream) {
  auto state = std::make_unique<StreamState>();
  state->stream = stream;
  const double phase = uniform() * static_cast<double>(stream.period.count());
  state->next_arrival = world_.clock.peek() + Nanoseconds(static_cast<std::int64_t>(phase));
  for (std::uint32_t k = 0; k < max_pending; ++k) {
    Slot& slot = state->slots.emplace_back();
    slot.transaction = world_.engine.make_transaction({.max_writes = stream.rows, .max_queries = 1});
    const auto cost_class = stream.max_elements > 2000 ? rtstdb::query::CostClass::nearest
                                                       : rtstdb::query::CostClass::ray_closest;
    slot.query =
        std::make_unique<SimulatedQuery>(std::max(1u, stream.max_elements), 0, cost_class, stream.late);
  }
  streams_.push_back(std::move(state));
}

void SimulatedLoad::run(std::uint64_t transactions,
                        const std::function<void(const CompletedTransaction&)>& completed) {
  completed_ = completed;
  remaining_ = transactions;
  bool done = false;
  // Only the engine thread uses the simulation, here between two transactions.
  while (!done) {
    world_.engine.call([&] {
      step();
      done = remaining_ == 0 && pending_ == 0;
    });
  }
  completed_ = nullptr;
}

void SimulatedLoad::step() {
  submit_due();
  pending_ = 0;
  for (const auto& state : streams_) {
    for (Slot& slot : state->slots) {
      if (slot.used && slot.transaction->status() == Status::pending)
        ++pending_;
      else
        collect(*state, slot);
    }
  }
  if (pending_ > 0 || remaining_ == 0) return;
  ClockTime next = ClockTime::max();
  for (const auto& state : streams_)
    next = std::min(next, state->next_arrival);
  world_.clock.advance(std::max(next - world_.clock.peek(), 0ns));
  submit_due();
  pending_ = 1;  // until the next step counts
}

void SimulatedLoad::collect(StreamState& state, Slot& slot) {
  if (std::exchange(slot.used, false) && completed_)
    completed_({&state.stream, slot.deadline, slot.transaction.get()});
}

void SimulatedLoad::submit_due() {
  for (const auto& state : streams_) {
    while (remaining_ > 0 && state->next_arrival <= world_.clock.peek())
      submit_next(*state);
    if (options_.cancelled_one_in == 0) continue;
    for (Slot& slot : state->slots) {
      if (!slot.used || slot.cancel_at > world_.clock.peek()) continue;
      slot.cancel_at = ClockTime::max();
      world_.engine.cancel(*slot.transaction);
    }
  }
}

void SimulatedLoad::submit_next(StreamState& state) {
  const Stream& stream = state.stream;
  const ClockTime arrival = state.next_arrival;
  const auto mean = static_cast<double>(stream.period.count());
  state.next_arrival +=
      stream.at_random
          ? Nanoseconds(1 + static_cast<std::int64_t>(std::exponential_distribution<>(1.0 / mean)(random_)))
          : stream.period;
  Slot& slot = state.slots[state.next];
  if (slot.used && slot.transaction->status() == Status::pending) return;
  collect(state, slot);
  state.next = (state.next + 1) % state.slots.size();
  --remaining_;
  rtstdb::Terms terms;
  terms.deadline_class = stream.deadline_class;
  terms.reservation = stream.reservation;
  if (stream.max_deadline > 0ns) {
    const auto range = static_cast<double>((stream.max_deadline - stream.min_deadline).count());
    terms.deadline =
        arrival + stream.min_deadline + Nanoseconds(static_cast<std::int64_t>(uniform() * range));
  }
  slot.deadline = terms.deadline;
  terms.importance = static_cast<std::uint8_t>(
      stream.min_importance + random_() % (stream.max_importance - stream.min_importance + 1u));
  slot.transaction->begin(terms);
  for (std::uint32_t k = 0; k < stream.rows; ++k)
    slot.transaction->update({static_cast<std::uint32_t>(random_() % entities), 1}, row_of(1));
  if (stream.max_elements > 0) {
    const std::uint64_t range = stream.max_elements - stream.min_elements + 1;
    slot.transaction->add_query(*slot.query,
                                stream.min_elements + static_cast<std::uint32_t>(random_() % range));
  }
  slot.used = true;
  const bool cancelled = options_.cancelled_one_in != 0 && random_() % options_.cancelled_one_in == 0;
  slot.cancel_at = cancelled ? arrival + Nanoseconds(random_() % 4'000'000) : ClockTime::max();
  world_.engine.submit(*slot.transaction);
}

void SimulatedLoad::pass(Nanoseconds time) {
  const ClockTime end = world_.clock.peek() + time;
  while (remaining_ > 0) {
    const auto first =
        std::ranges::min_element(streams_, {}, [](const auto& state) { return state->next_arrival; });
    if (first == streams_.end() || (*first)->next_arrival >= end) break;
    world_.clock.advance(std::max((*first)->next_arrival - world_.clock.peek(), 0ns));
    submit_next(**first);
  }
  world_.clock.advance(std::max(end - world_.clock.peek(), 0ns));
  if (options_.clock_jump_one_in != 0 && random_() % options_.clock_jump_one_in == 0)
    world_.clock.advance(Nanoseconds(random_() % 1'000'000'000));
  submit_due();
}

rtstdb::query::RunReport SimulatedLoad::run_batch(std::span<const rtstdb::query::Request> requests,
                                                  rtstdb::query::ExecutorCallbacks* callbacks) {
  using enum rtstdb::query::ExecutorCallbacks::Continuation;
  using rtstdb::query::RunStatus;
  const bool expensive =
      options_.expensive_batch_one_in != 0 && random_() % options_.expensive_batch_one_in == 0;
  for (std::size_t k = 0; k < requests.size(); ++k) {
    const auto& request = requests[k];
    auto& query = dynamic_cast<SimulatedQuery&>(*request.query);
    query.answer(0, 0, 0.0f);
    const std::uint32_t step = request.per_chunk == 0 ? request.count : request.per_chunk;
    for (std::uint32_t first = 0; first < request.count; first += step) {
      const std::uint32_t end = std::min(first + step, request.count);
      const double per_element = 1.0 + options_.cost_spread * (2.0 * uniform() - 1.0);
      // The elements and the submission.
      pass(Nanoseconds(
               static_cast<std::int64_t>((expensive ? 4000.0 : 1000.0) * per_element * (end - first))) +
           5us);
      query.answer(first, end, 1.0f);
      const bool last = k + 1 == requests.size() && end == request.count;
      if (last || callbacks == nullptr || request.per_chunk == 0) continue;
      const auto continuation = callbacks->on_preemption_point();
      if (continuation == stop) return {.status = RunStatus::stopped};
      if (continuation == finish_in_flight) return {.status = RunStatus::partial};
    }
  }
  return {};
}

}  // namespace hil::long_test
