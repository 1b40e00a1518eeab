#pragma once
// Loads on an engine whose clock, device and costs are simulated: streams of transactions that come when they
// come, while others are carried out. Time passes in the device's work and a little at each reading of the
// clock, and in nothing else; so what is late is the scheduler's doing.

#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "tests/support/simulation/engine.hpp"

namespace hil::stress {

using rtstdb::ClockTime;
using rtstdb::Nanoseconds;

/// Transactions of one kind.
struct Stream {
  std::string name = {};
  Nanoseconds period{0};  ///< between two of them; on average, where they come at random
  bool at_random = false;
  rtstdb::DeadlineClass deadline_class = rtstdb::DeadlineClass::soft;
  rtstdb::Reservation* reservation = nullptr;
  /// From when they come; both zero: none, or the reservation's.
  Nanoseconds shortest_deadline{0}, longest_deadline{0};
  std::uint8_t min_importance = 0, max_importance = 0;
  std::uint32_t fewest_elements = 0, max_elements = 0;  ///< asked; an element takes a microsecond on average
  std::uint32_t rows = 0;                               ///< written
  rtstdb::LatePolicy late = rtstdb::LatePolicy::discard;
  std::uint32_t slots = 64;  ///< so many may be pending at once; one more does not come, which is counted
};

/// How one of them ended.
struct Ended {
  const Stream* stream = nullptr;
  ClockTime came{};  ///< a deadline counts from here
  ClockTime deadline{};
  const rtstdb::Transaction* transaction = nullptr;
};

struct LoadOptions {
  std::uint64_t seed = 1;
  /// What an element costs: at random within this of a microsecond, 0 to 1.
  double spread = 0.3;
  /// One batch of so many takes four times as long; 0: none.
  std::uint32_t one_dear_in = 0;
  /// At one in so many readings the clock jumps ahead by up to a second; 0: never.
  std::uint32_t one_jump_in = 0;
  /// One transaction in so many is cancelled a while after it came; 0: none.
  std::uint32_t one_cancelled_in = 0;
  Nanoseconds per_reading{100};
  std::uint32_t queue_capacity = 4096;
};

class SimulatedLoad {
 public:
  explicit SimulatedLoad(const LoadOptions& options);
  ~SimulatedLoad();
  SimulatedLoad(const SimulatedLoad&) = delete;
  SimulatedLoad& operator=(const SimulatedLoad&) = delete;

  rtstdb::transaction::Engine& engine() { return world_.engine; }
  const rtstdb::transaction::test::SimulatedClock& clock() const { return world_.clock; }
  /// Before the first run. Streams stay where they are.
  void add(const Stream& stream);
  /// Until so many have come; then all are waited for. `ended` is called once for each, on a thread of its
  /// own choice, never on two at once.
  void run(std::uint64_t transactions, const std::function<void(const Ended&)>& ended);
  std::uint64_t left_out() const { return left_out_; }

 private:
  struct Slot;
  struct Flow;

  rtstdb::query::RunReport carry_out(std::span<const rtstdb::query::Request> requests,
                                     rtstdb::query::ExecutorCallbacks* callbacks);
  /// The device works for so long; who comes meanwhile is submitted when he comes.
  void pass(Nanoseconds time);
  void submit_due();
  void submit_next(Flow& flow);
  void collect(Slot& slot);
  /// When nothing is left to do: to the next one who comes.
  void step();
  double uniform() { return std::uniform_real_distribution<>(0.0, 1.0)(random_); }

  class Executor final : public rtstdb::query::Executor {
   public:
    explicit Executor(SimulatedLoad& load) : load_(load) {}
    rtstdb::query::RunReport run(const rtstdb::store::RowSource&,
                                 std::span<const rtstdb::query::Request> requests,
                                 const rtstdb::store::TimeSpan&,
                                 rtstdb::query::ExecutorCallbacks* callbacks) noexcept override {
      return load_.carry_out(requests, callbacks);
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
  LoadOptions options_;
  std::mt19937_64 random_;
  World world_;
  std::vector<std::unique_ptr<Flow>> flows_;
  std::function<void(const Ended&)> ended_;
  std::uint64_t to_come_ = 0, pending_ = 0, left_out_ = 0;
};

/// The share of the device's time that the streams ask for.
double load_of(std::span<const Stream> streams);

}  // namespace hil::stress
