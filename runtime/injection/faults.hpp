#pragma once
// Faults of a run: when they are active, and what they act on.
//
// Of a signal: readers that a fault names read the signal "x.faulted" in place of "x"; "x" keeps the true
// value, which expectations, variables and the other readers read. Several faults of one signal act in the
// order of the scenario. In a tick all activations are updated first, by the signals as they are when the
// tick begins. From then on each "x.faulted" follows its signal (faulty_signal.hpp).
//
// Of anything else: the run gives a FaultSwitch.
//
// "fault.NAME" is 1 while a fault is active.
//
// Threads: declare, redirect and compile on the one that wires the run, in this order; begin_tick and
// end_tick on the base thread, without allocation; fill after the run.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <hil/event_log.hpp>

#include "runtime/config/scenario.hpp"
#include "runtime/injection/activation.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::injection {

/// A reader of a signal, which can be redirected to another one.
struct Reader {
  std::string owner;           ///< "control", "can.car"
  std::string name;            ///< "control.level"
  std::int64_t period_ns = 0;  ///< of the task, or of the frames of a message
  signals::SignalId* signal = nullptr;
};

/// What became of a fault that began.
struct FaultOutcome {
  std::optional<bool> took_effect{};      ///< empty: not known
  std::string missing{};                  ///< why it took none, as a clause for the report
  std::optional<std::uint64_t> frames{};  ///< frames or requests that came in its time; empty: not counted
};

/// Begins and ends the fault of a message, a device, a process or a task.
class FaultSwitch {
 public:
  virtual ~FaultSwitch() = default;
  /// At the begin of a tick, after the inputs of devices are latched. Neither allocates nor blocks.
  virtual void set(bool active) noexcept = 0;
  /// After the run.
  virtual FaultOutcome outcome() const = 0;
};

class FaultySignal;

class Faults {
 public:
  Faults();
  Faults(Faults&&) noexcept;
  Faults& operator=(Faults&&) noexcept;
  ~Faults();

  /// Adds the signals "fault.NAME" and "x.faulted". After the signals of modules and buses are declared, and
  /// before the variables, on which no fault acts.
  void declare(const config::Scenario& scenario, signals::KnownSignals& known,
               config::Diagnostics& diagnostics);
  /// A reader that a fault names and that does not read its signal is a mistake.
  void redirect(std::span<const Reader> readers, config::Diagnostics& diagnostics);
  /// An expectation reads these signals.
  void add_reading_expectation(const std::string& name, std::span<const signals::SignalId> read,
                               const signals::SignalTable& table);
  /// A mistake for each fault of a signal that nobody reads. After all readers are known.
  void check_readers(config::Diagnostics& diagnostics) const;
  void compile(const config::Scenario& scenario, const signals::KnownSignals& known,
               config::Diagnostics& diagnostics);

  /// Before the first tick. The table, the log and the switches outlive the last tick. `switches`: by fault
  /// of the scenario; null for those of signals.
  void open(signals::SignalTable& table, modules::EventLog& events,
            std::span<FaultSwitch* const> switches = {});
  /// After the inputs of devices are latched.
  void begin_tick(std::int64_t time_ns) noexcept;
  /// After all tasks.
  void end_tick(std::int64_t time_ns) noexcept;

  void fill(std::int64_t end_ns, report::RunRecord& record) const;

 private:
  struct Fault;
  void declare_signal(const config::Scenario& scenario, Fault& fault, signals::KnownSignals& known,
                      config::Diagnostics& diagnostics);
  FaultOutcome outcome_of(const Fault& fault) const;

  std::vector<std::unique_ptr<Fault>> faults_;  ///< in the order of the scenario
  std::vector<std::unique_ptr<FaultySignal>> faulty_;
  signals::SignalTable* table_ = nullptr;
  modules::EventLog* events_ = nullptr;
};

}  // namespace hil::injection
