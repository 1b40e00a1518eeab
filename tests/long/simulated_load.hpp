#pragma once
// Streams of transactions on an engine whose clock, device and costs are simulated. Time passes in the work
// of the device and a little at each reading of the clock, and nowhere else: only the scheduler makes a
// transaction late.

#include <cstdint>
#include <functional>
#include <initializer_list>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/support/simulation/engine.hpp"

namespace hil::long_test {

using rtstdb::ClockTime;
using rtstdb::Nanoseconds;

/// Transactions of one kind.
struct Stream {
  std::string name = {};
  Nanoseconds period{0};  ///< from one to the next; the mean where they are `at_random`
  bool at_random = false;
  rtstdb::DeadlineClass deadline_class = rtstdb::DeadlineClass::soft;
  rtstdb::Reservation* reservation = nullptr;
  /// Relative to the arrival; both zero: no deadline, or that of the reservation.
  Nanoseconds min_deadline{0}, max_deadline{0};
  std::uint8_t min_importance = 0, max_importance = 0;
  std::uint32_t min_elements = 0,
                max_elements = 0;  ///< of its query; an element takes a microsecond on average
  std::uint32_t rows = 0;          ///< written
  rtstdb::LatePolicy late = rtstdb::LatePolicy::discard;
};

/// What distinguishes streams with common terms.
struct Demand {
  const char* name = "";
  Nanoseconds period{0};
  std::uint32_t min_elements = 0, max_elements = 0;
  std::uint32_t rows = 0;
};
std::vector<Stream> streams_of(const Stream& common, std::initializer_list<Demand> demands);

/// The streams' share of the time of the device.
double load_of(std::span<const Stream> streams);

struct CompletedTransaction {
  const Stream* stream = nullptr;
  ClockTime deadline{};
  const rtstdb::Transaction* transaction = nullptr;
};

struct LoadOptions {
  std::uint64_t seed = 1;
  double cost_spread = 0.3;                  ///< an element costs 1 us times 1 - spread to 1 + spread
  std::uint32_t expensive_batch_one_in = 0;  ///< costs four times as much; 0: none
  std::uint32_t clock_jump_one_in = 0;       ///< steps of the device, by up to a second; 0: none
  std::uint32_t cancelled_one_in = 0;        ///< transactions, up to 4 ms after their arrival; 0: none
  Nanoseconds time_per_reading{100};
  std::uint32_t queue_capacity = 4096;
};

class SimulatedLoad {
 public:
  explicit SimulatedLoad(const LoadOptions& options);
  ~SimulatedLoad();
  SimulatedLoad(const SimulatedLoad&) = delete;
  SimulatedLoad& operator=(const SimulatedLoad&) = delete;

  rtstdb::transaction::Engine& engine() { return world_.engine; }
  void add(const Stream& stream);
  /// Submits that many transactions and waits for them. Calls `completed` once for each, in one thread at a
  /// time.
  void run(std::uint64_t transactions,
           const std::function<void(const CompletedTransaction&)>& completed = {});

 private:
  struct Slot;
  struct StreamState;

  rtstdb::query::RunReport run_batch(std::span<const rtstdb::query::Request> requests,
                                     rtstdb::query::ExecutorCallbacks* callbacks);
  /// The device works for that time. Transactions that arrive in it are submitted at their arrival.
  void pass(Nanoseconds time);
  void submit_due();
  void submit_next(StreamState& state);
  void collect(StreamState& state, Slot& slot);
  /// Between two transactions; without a pending one, time passes until the next arrival.
  void step();
  double uniform() { return std::uniform_real_distribution<>(0.0, 1.0)(random_); }

  class Executor final : public rtstdb::query::Executor {
   public:
    explicit Executor(SimulatedLoad& load) : load_(load) {}
    rtstdb::query::RunReport run(const rtstdb::store::RowSource&,
                                 std::span<const rtstdb::query::Request> requests,
                                 const rtstdb::store::TimeSpan&,
                                 rtstdb::query::ExecutorCallbacks* callbacks) noexcept override {
      return load_.run_batch(requests, callbacks);
    }

   private:
    SimulatedLoad& load_;
  };
  struct World {
    World(const rtstdb::transaction::EngineOptions& options, SimulatedLoad& load)
        : executor(load), engine(options, executor, clock) {}
    rtstdb::transaction::test::SimulatedClock clock;
    Executor executor;
    rtstdb::transaction::Engine engine;
  };

  static constexpr std::uint32_t entities = 64;
  static constexpr std::uint32_t max_pending = 64;  ///< of one stream; further arrivals are left out
  LoadOptions options_;
  std::mt19937_64 random_;
  World world_;
  std::vector<std::unique_ptr<StreamState>> streams_;
  std::function<void(const CompletedTransaction&)> completed_;
  std::uint64_t remaining_ = 0, pending_ = 0;
};

}  // namespace hil::long_test
