#include "tests/long/simulated_load.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace hil::stress {

using namespace std::chrono_literals;
using rtstdb::Status;
using rtstdb::transaction::test::row_of;
using rtstdb::transaction::test::SimulatedQuery;

struct SimulatedLoad::Slot {
  std::unique_ptr<rtstdb::Transaction> transaction;
  std::unique_ptr<SimulatedQuery> query;
  ClockTime came{}, deadline{};
  ClockTime cancel_at = ClockTime::max();
  bool used = false;
};

struct SimulatedLoad::Flow {
  Stream stream;
  std::vector<Slot> slots;
  std::size_t next = 0;
  ClockTime comes{};
};

SimulatedLoad::SimulatedLoad(const LoadOptions& options)
    : options_(options),
      random_(options.seed),
      world_(rtstdb::transaction::test::engine_options(options.queue_capacity, entities, 1u << 16), *this) {
  world_.clock.per_reading_ns = options.per_reading.count();
  const auto creation = world_.engine.make_transaction({.max_writes = entities});
  creation->begin({});
  for (std::uint32_t k = 0; k < entities; ++k)
    creation->create(row_of(0));
  world_.engine.submit(*creation);
  world_.engine.wait(*creation);
}

SimulatedLoad::~SimulatedLoad() = default;

void SimulatedLoad::add(const Stream& stream) {
  auto flow = std::make_unique<Flow>();
  flow->stream = stream;
  // Streams that begin at once are no likelier than others.
  flow->comes =
      world_.clock.peek() +
      Nanoseconds(static_cast<std::int64_t>(uniform() * static_cast<double>(stream.period.count())));
  for (std::uint32_t k = 0; k < stream.slots; ++k) {
    Slot& slot = flow->slots.emplace_back();
    slot.transaction = world_.engine.make_transaction({.max_writes = stream.rows, .max_queries = 1});
    const auto cost_class = stream.max_elements > 2000 ? rtstdb::query::CostClass::nearest
                                                       : rtstdb::query::CostClass::ray_closest;
    slot.query =
        std::make_unique<SimulatedQuery>(std::max(1u, stream.max_elements), 0, cost_class, stream.late);
  }
  flows_.push_back(std::move(flow));
}

void SimulatedLoad::run(std::uint64_t transactions, const std::function<void(const Ended&)>& ended) {
  ended_ = ended;
  to_come_ = transactions;
  bool done = false;
  // On the engine thread, between two transactions: all that is simulated is touched there alone.
  while (!done) {
    world_.engine.call([&] {
      step();
      done = to_come_ == 0 && pending_ == 0;
    });
  }
  ended_ = nullptr;
}

void SimulatedLoad::step() {
  submit_due();
  pending_ = 0;
  for (const auto& flow : flows_) {
    for (Slot& slot : flow->slots) {
      if (slot.used && slot.transaction->status() == Status::pending)
        ++pending_;
      else
        collect(slot);
    }
  }
  if (pending_ > 0 || to_come_ == 0) return;
  ClockTime next = ClockTime::max();
  for (const auto& flow : flows_)
    next = std::min(next, flow->comes);
  world_.clock.advance(std::max(next - world_.clock.peek(), 0ns));
  submit_due();
  pending_ = 1;  // looked at in the next step
}

void SimulatedLoad::collect(Slot& slot) {
  if (!std::exchange(slot.used, false)) return;
  for (const auto& flow : flows_) {
    if (&slot < flow->slots.data() || &slot >= flow->slots.data() + flow->slots.size()) continue;
    ended_({&flow->stream, slot.came, slot.deadline, slot.transaction.get()});
  }
}

void SimulatedLoad::submit_due() {
  for (const auto& flow : flows_) {
    while (to_come_ > 0 && flow->comes <= world_.clock.peek())
      submit_next(*flow);
    if (options_.one_cancelled_in == 0) continue;
    for (Slot& slot : flow->slots) {
      if (!slot.used || slot.cancel_at > world_.clock.peek()) continue;
      slot.cancel_at = ClockTime::max();
      world_.engine.cancel(*slot.transaction);
    }
  }
}

void SimulatedLoad::submit_next(Flow& flow) {
  const Stream& stream = flow.stream;
  const ClockTime comes = flow.comes;
  flow.comes += stream.at_random
                    ? Nanoseconds(1 + static_cast<std::int64_t>(std::exponential_distribution<>(
                                          1.0 / static_cast<double>(stream.period.count()))(random_)))
                    : stream.period;
  Slot& slot = flow.slots[flow.next];
  if (slot.used && slot.transaction->status() == Status::pending) {
    ++left_out_;
    return;
  }
  collect(slot);
  flow.next = (flow.next + 1) % flow.slots.size();
  --to_come_;
  slot.came = comes;
  rtstdb::Terms terms;
  terms.deadline_class = stream.deadline_class;
  terms.reservation = stream.reservation;
  if (stream.longest_deadline > 0ns) {
    const auto range = static_cast<double>((stream.longest_deadline - stream.shortest_deadline).count());
    terms.deadline =
        comes + stream.shortest_deadline + Nanoseconds(static_cast<std::int64_t>(uniform() * range));
  }
  slot.deadline = terms.deadline;
  terms.importance = static_cast<std::uint8_t>(
      stream.min_importance + random_() % (stream.max_importance - stream.min_importance + 1u));
  slot.transaction->begin(terms);
  for (std::uint32_t k = 0; k < stream.rows; ++k)
    slot.transaction->update({static_cast<std::uint32_t>(random_() % entities), 1}, row_of(1));
  if (stream.max_elements > 0) {
    const std::uint64_t range = stream.max_elements - stream.fewest_elements + 1;
    slot.transaction->add_query(*slot.query,
                                stream.fewest_elements + static_cast<std::uint32_t>(random_() % range));
  }
  slot.used = true;
  const bool cancelled = options_.one_cancelled_in != 0 && random_() % options_.one_cancelled_in == 0;
  slot.cancel_at = cancelled ? comes + Nanoseconds(random_() % 4'000'000) : ClockTime::max();
  world_.engine.submit(*slot.transaction);
}

void SimulatedLoad::pass(Nanoseconds time) {
  const ClockTime end = world_.clock.peek() + time;
  while (to_come_ > 0) {
    Flow* first = nullptr;
    for (const auto& flow : flows_) {
      if (first == nullptr || flow->comes < first->comes) first = flow.get();
    }
    if (first == nullptr || first->comes >= end) break;
    world_.clock.advance(std::max(first->comes - world_.clock.peek(), 0ns));
    submit_next(*first);
  }
  world_.clock.advance(std::max(end - world_.clock.peek(), 0ns));
  if (options_.one_jump_in != 0 && random_() % options_.one_jump_in == 0)
    world_.clock.advance(Nanoseconds(random_() % 1'000'000'000));
  submit_due();
}

rtstdb::query::RunReport SimulatedLoad::carry_out(std::span<const rtstdb::query::Request> requests,
                                                  rtstdb::query::ExecutorCallbacks* callbacks) {
  using rtstdb::query::ExecutorCallbacks;
  using rtstdb::query::RunStatus;
  // Each chunk costs what it costs: elements, and something for the submission.
  const bool dear = options_.one_dear_in != 0 && random_() % options_.one_dear_in == 0;
  for (std::size_t k = 0; k < requests.size(); ++k) {
    const auto& request = requests[k];
    auto& query = dynamic_cast<SimulatedQuery&>(*request.query);
    query.answer(0, 0, 0.0f);
    const std::uint32_t step = request.per_chunk == 0 ? request.count : request.per_chunk;
    for (std::uint32_t first = 0; first < request.count; first += step) {
      const std::uint32_t end = std::min(first + step, request.count);
      const double per_element = 1.0 + options_.spread * (2.0 * uniform() - 1.0);
      pass(Nanoseconds(static_cast<std::int64_t>((dear ? 4000.0 : 1000.0) * per_element * (end - first))) +
           5us);
      query.answer(first, end, 1.0f);
      const bool last = k + 1 == requests.size() && end == request.count;
      // Two that share are one chunk.
      if (last || callbacks == nullptr || request.per_chunk == 0) continue;
      const ExecutorCallbacks::Continuation gap = callbacks->on_preemption_point();
      if (gap == ExecutorCallbacks::Continuation::stop) return {.status = RunStatus::stopped};
      if (gap == ExecutorCallbacks::Continuation::finish_in_flight) return {.status = RunStatus::partial};
    }
  }
  return {};
}

double load_of(std::span<const Stream> streams) {
  double sum = 0.0;
  for (const Stream& stream : streams) {
    const double elements = 0.5 * (stream.fewest_elements + stream.max_elements);
    sum += elements * 1000.0 / static_cast<double>(stream.period.count());
  }
  return sum;
}

}  // namespace hil::stress
