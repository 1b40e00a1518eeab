#pragma once
// A module as a task of the executive: copies its inputs from the signal table, steps it, and publishes its
// outputs. A module works on copies, so that one on a task thread never accesses the table.

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <hil/world/world_module.hpp>

#include "runtime/executive/clock.hpp"
#include "runtime/executive/task.hpp"
#include "runtime/run/clocks.hpp"
#include "runtime/signals/links.hpp"

namespace hil::run {

class ModuleTask final : public executive::Task {
 public:
  struct Links {
    std::vector<signals::InputSource> inputs;  ///< by input port
    std::vector<signals::SignalId> outputs;    ///< by output port
  };

  /// `name`: of the module, for sentences: "module pump (plug-in pumps)". `database`: null when the run has
  /// none. `firm`: see modules::WorldStep::read_class.
  ModuleTask(std::string name, modules::AnyModule& module, Links links, std::int64_t deadline_ns,
             signals::SignalTable& table, const rtstdb::Database* database, const DeviceClock& run_clock,
             modules::EventLog& events, bool firm = false);

  void latch(const executive::TickInfo& tick) noexcept override;
  void queue(const executive::TickInfo& tick) noexcept override;
  void step(const executive::TickInfo& tick) noexcept override;
  void publish(const executive::TickInfo& tick) noexcept override;
  /// Base thread: from the next step on, each takes so much longer; faults add up.
  void add_duration(std::int64_t added_ns) noexcept {
    added_ns_.fetch_add(added_ns, std::memory_order_relaxed);
  }
  /// The steps that faults have made longer. Any thread.
  std::uint64_t longer_steps() const noexcept { return longer_steps_.load(std::memory_order_relaxed); }
  std::int64_t added_ns() const noexcept override { return step_added_ns_; }
  std::int64_t last_blocked_ns() const noexcept override { return context_.blocked_ns; }
  std::int64_t last_gpu_ns() const noexcept override { return context_.gpu_ns; }

  /// A step threw: the outputs are unknown from that run on, and the module is not stepped again. Any thread.
  bool has_failed() const noexcept { return has_failed_.load(std::memory_order_acquire); }
  /// What it threw, as a sentence; empty: it has not failed.
  const std::string& fault() const noexcept { return fault_; }
  /// The number of runs, warm-up runs included, in which a transaction failed: their outputs are those of
  /// an earlier run. After the run.
  std::uint64_t runs_without_result() const noexcept { return runs_without_result_; }
  /// The status of the first such transaction.
  rtstdb::Status first_failure() const noexcept { return first_failure_; }
  /// The ones among these runs with a firm transaction that missed its deadline or was not admitted.
  std::uint64_t discarded_runs() const noexcept { return discarded_runs_; }

  /// A run with a hard transaction that was late.
  struct HardMiss : modules::WorldStep::HardMiss {
    std::uint64_t tick = 0;
  };
  /// The number of such runs, warm-up runs included, the first of them, and the latest. After the run.
  std::uint64_t hard_misses() const noexcept { return hard_misses_; }
  std::span<const HardMiss> first_hard_misses() const noexcept {
    return std::span(first_hard_misses_).first(std::min<std::uint64_t>(hard_misses_, max_hard_misses));
  }
  const HardMiss& worst_hard_miss() const noexcept { return worst_hard_miss_; }

 private:
  void latch_inputs(std::vector<signals::SignalValue>& inputs) noexcept;
  rtstdb::Version latest_version() const noexcept;

  void fail(const executive::TickInfo& tick) noexcept;

  const std::string name_;
  modules::Module* const plain_;  ///< or world_
  modules::WorldModule* const world_;
  const Links links_;
  const std::int64_t deadline_ns_;
  signals::SignalTable& table_;
  const rtstdb::Database* const database_;
  const DeviceClock& run_clock_;
  std::vector<signals::ReadObserver*> read_observers_;
  std::vector<signals::SignalValue> inputs_;
  // Inputs and version of a queued release, as of its tick.
  std::vector<signals::SignalValue> kept_inputs_;
  rtstdb::Version kept_version_ = 0;
  bool kept_ = false;
  std::vector<double> outputs_;
  modules::WorldStep context_;
  std::atomic<std::int64_t> added_ns_{0};
  std::int64_t step_added_ns_ = 0;  ///< of the last step
  std::atomic<std::uint64_t> longer_steps_{0};
  std::atomic<bool> has_failed_{false};
  std::string fault_;
  std::uint64_t runs_without_result_ = 0, discarded_runs_ = 0;
  rtstdb::Status first_failure_ = rtstdb::Status::idle;
  static constexpr std::size_t max_hard_misses = 20;
  std::uint64_t hard_misses_ = 0;
  std::array<HardMiss, max_hard_misses> first_hard_misses_;
  HardMiss worst_hard_miss_;
};

}  // namespace hil::run
