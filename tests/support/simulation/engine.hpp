#pragma once
// Simulated queries, a simulated executor, and an engine on these and a simulated clock.

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <semaphore>
#include <string>
#include <vector>

#include "rtstdb/transaction/engine.hpp"
#include "tests/support/simulation/clock.hpp"

namespace rtstdb::transaction::test {

using hil::tests::SimulatedClock;

/// A ray query that checks the times of its rays; tests know by `label` which query ran.
class SimulatedQuery final : public RayQuery, public query::PreparedQuery {
 public:
  explicit SimulatedQuery(std::uint32_t capacity, int label_given = 0,
                          query::CostClass cost_class = query::CostClass::ray_closest,
                          LatePolicy late = LatePolicy::discard)
      : PreparedQuery(late),
        label(label_given),
        cost_class_(cost_class),
        rays_(capacity),
        hits_(capacity),
        kept_(capacity) {}

  std::span<Ray> rays() noexcept override { return rays_; }
  std::span<const RayHit> hits() const noexcept override { return std::span(kept_).first(readable_); }
  const AnswerInfo& answer_info() const noexcept override { return info; }
  query::CostClass cost_class() const noexcept override { return cost_class_; }
  std::uint32_t capacity() const noexcept override { return static_cast<std::uint32_t>(rays_.size()); }
  std::optional<BadInput> check(std::uint32_t count, const store::RowSource& rows,
                                store::TimeSpan& times) const noexcept override {
    for (std::uint32_t k = 0; k < count; ++k) {
      const WorldTime t = rays_[k].t;
      if (t < rows.time()) {
        BadInput fault;
        fault.reason = BadInputReason::time_not_covered;
        fault.element = k;
        return fault;
      }
      times.first = std::min(times.first, t);
      times.last = std::max(times.last, t);
    }
    return std::nullopt;
  }

  std::uint32_t answered() const noexcept override { return answered_; }
  std::uint32_t incomplete(std::uint32_t) const noexcept override { return 0; }
  bool truncated() const noexcept override { return is_truncated; }
  void publish_answers(std::uint32_t answered, std::uint32_t count) noexcept override {
    std::ranges::copy(hits_, kept_.begin());
    for (std::uint32_t k = answered; k < count; ++k)
      kept_[k].status = HitStatus::incomplete;
    readable_ = count;
  }
  void discard_answers() noexcept override {
    if (late() != LatePolicy::last_good) readable_ = 0;
  }
  /// Elements [first, end) are answered: each hits something at distance `lambda`.
  void answer(std::uint32_t first, std::uint32_t end, float lambda) {
    answered_ = end;
    for (std::uint32_t k = first; k < end; ++k) {
      hits_[k].status = HitStatus::hit;
      hits_[k].lambda = lambda;
    }
  }

  const int label;
  bool is_truncated = false;

 private:
  query::CostClass cost_class_;
  std::vector<Ray> rays_;
  std::vector<RayHit> hits_, kept_;
  std::uint32_t answered_ = 0, readable_ = 0;
};

constexpr std::uint32_t unmeasured_chunk = 4096;  ///< elements, before anything is known of a kind

/// Calls `work` for each run; without it a run takes no time.
class SimulatedExecutor final : public query::Executor {
 public:
  using Work = std::function<query::RunReport(const store::RowSource&, std::span<const query::Request>,
                                              const store::TimeSpan&)>;

  query::RunReport run(const store::RowSource& rows, std::span<const query::Request> requests,
                       const store::TimeSpan& times, query::ExecutorCallbacks* callbacks) noexcept override {
    using enum query::RunStatus;
    if (while_draining && callbacks != nullptr) {
      callbacks->begin_drain();
      while_draining();
      callbacks->end_drain();
    }
    for (const query::Request& request : requests)
      dynamic_cast<SimulatedQuery&>(*request.query).answer(0, chunk ? 0 : request.count, lambda);
    if (chunk) {
      const query::RunStatus ended = run_chunks(rows, requests, callbacks);
      if (ended != done) return {ended, 0};
    }
    if (while_waiting && callbacks != nullptr) {
      callbacks->begin_wait();
      waits_ = callbacks;
      while_waiting();
      waits_ = nullptr;
      callbacks->end_wait();
    }
    return work ? work(rows, requests, times) : query::RunReport{};
  }

  /// Set before the first transaction, or while none is in execution.
  Work work;
  /// One chunk of a batch that is divided: elements [first, end) of a request. None: a batch is one step.
  std::function<void(const store::RowSource&, const query::Request&, std::uint32_t first, std::uint32_t end)>
      chunk;
  /// What happens while a run waits for the device; none: it never waits.
  std::function<void()> while_waiting;
  /// For `while_waiting`.
  bool preemption_requested() const noexcept { return waits_ != nullptr && waits_->preemption_requested(); }
  /// What happens while a run waits, before it begins, for what the device executes of the run that it
  /// preempts; none: it does not wait.
  std::function<void()> while_draining;
  float lambda = 0.0f;  ///< of all hits

 private:
  query::ExecutorCallbacks* waits_ = nullptr;
  query::RunStatus run_chunks(const store::RowSource& rows, std::span<const query::Request> requests,
                              query::ExecutorCallbacks* callbacks) {
    for (std::size_t k = 0; k < requests.size(); ++k) {
      const query::Request& request = requests[k];
      const std::uint32_t step = request.per_chunk == 0 ? request.count : request.per_chunk;
      for (std::uint32_t first = 0; first < request.count; first += step) {
        const bool last = k + 1 == requests.size() && first + step >= request.count;
        if (callbacks != nullptr) callbacks->begin_wait();
        chunk(rows, request, first, std::min(first + step, request.count));
        if (callbacks != nullptr) callbacks->end_wait();
        const std::uint32_t end = std::min(first + step, request.count);
        dynamic_cast<SimulatedQuery&>(*request.query).answer(first, end, lambda);
        if (last || callbacks == nullptr) continue;
        switch (callbacks->on_preemption_point()) {
          case query::ExecutorCallbacks::Continuation::go_on:
            break;
          case query::ExecutorCallbacks::Continuation::finish_in_flight:
            return query::RunStatus::partial;
          case query::ExecutorCallbacks::Continuation::stop:
            return query::RunStatus::stopped;
        }
      }
    }
    return query::RunStatus::done;
  }
};

/// Holds the engine thread inside the executor until opened.
class Gate {
 public:
  void pass() {
    arrived_.release();
    opened_.acquire();
  }
  void wait_until_held() { arrived_.acquire(); }
  void open() { opened_.release(); }

 private:
  std::binary_semaphore arrived_{0};
  std::binary_semaphore opened_{0};
};

inline EngineOptions engine_options(std::uint32_t queue_capacity = 64, std::uint32_t max_entities = 64,
                                    std::uint32_t retained_changes = 1024) {
  return {{max_entities, retained_changes, [](GeometryId id) { return id.index == 0; }},
          queue_capacity,
          Nanoseconds(1'000'000),
          0,
          Nanoseconds(0)};
}

inline EntityRow row_of(std::uint32_t mask) {
  EntityRow row;
  row.geometry = GeometryId{0};
  row.mask = mask;
  return row;
}

inline Terms terms(DeadlineClass deadline_class, ClockTime deadline = ClockTime::max(),
                   std::uint8_t importance = 0) {
  Terms made;
  made.deadline_class = deadline_class;
  made.deadline = deadline;
  made.importance = importance;
  return made;
}

inline TransactionOptions options_for(std::uint32_t writes, std::uint32_t preconditions,
                                      std::uint32_t queries) {
  TransactionOptions made;
  made.max_writes = writes;
  made.max_preconditions = preconditions;
  made.max_queries = queries;
  made.max_reads = 4;
  return made;
}

/// Soft terms without a deadline.
inline Terms soft_terms(std::uint8_t importance) {
  return terms(DeadlineClass::soft, ClockTime::max(), importance);
}

inline int label_of(const query::Request& request) {
  return dynamic_cast<const SimulatedQuery&>(*request.query).label;
}

/// Begins `transaction` with `count` elements of `query` and nothing else.
inline Transaction& begin_query(Transaction& transaction, SimulatedQuery& query, const Terms& given,
                                std::uint32_t count = 1) {
  transaction.begin(given);
  transaction.add_query(query, count);
  return transaction;
}

/// One engine with everything simulated.
struct World {
  // The analyzer does not see into the engine's constructor.
  // NOLINTBEGIN(clang-analyzer-optin.cplusplus.UninitializedObject)
  explicit World(const EngineOptions& options = engine_options()) : engine(options, executor, clock) {}
  // NOLINTEND(clang-analyzer-optin.cplusplus.UninitializedObject)

  std::unique_ptr<Transaction> make(std::uint32_t max_writes = 8, std::uint32_t max_queries = 2) {
    return engine.make_transaction(options_for(max_writes, 4, max_queries));
  }
  const Outcome& execute(Transaction& transaction) {
    engine.submit(transaction);
    return engine.wait(transaction);
  }
  /// Creates an entity in a version of its own.
  EntityId create(std::uint32_t mask) {
    const auto transaction = make();
    transaction->begin({});
    const auto ordinal = transaction->create(row_of(mask));
    execute(*transaction);
    return transaction->created(ordinal);
  }
  /// The mask of the entity in the latest version; -1 when it is not there.
  std::int64_t mask(EntityId id) {
    const auto states = engine.snapshot(ReadAt::latest());
    for (const EntityState& state : states.value()) {
      if (state.id == id) return state.row.mask;
    }
    return -1;
  }

  SimulatedClock clock;
  SimulatedExecutor executor;
  Engine engine;
};

}  // namespace rtstdb::transaction::test
