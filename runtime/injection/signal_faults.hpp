#pragma once
// Faults of signals. Readers that a fault names read the signal "x.faulted" in place of "x"; "x" keeps the
// true value, which expectations, variables and the other readers read. "fault.NAME" is 1 while a fault is
// active. Several faults of one signal act in the order of the scenario.
//
// In a tick: first all activations are updated, by the signals as they are when the tick begins. From then on
// each "x.faulted" follows its signal: it is computed again at each write of it.
//
// Threads: declare, redirect and compile on the one that wires the run, in this order; begin_tick and
// end_tick on the base thread, without allocation; fill after the run.

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/injection/activation.hpp"
#include "runtime/modules/event_log.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::injection {

/// A reader of a signal, which can be redirected to another one.
struct Reader {
  std::string owner;  ///< "control", "can.car"
  std::string name;   ///< "control.level"
  signals::SignalId* signal = nullptr;
};

class SignalFaults {
 public:
  SignalFaults();
  SignalFaults(SignalFaults&&) noexcept;
  SignalFaults& operator=(SignalFaults&&) noexcept;
  ~SignalFaults();

  /// Adds the signals "fault.NAME" and "x.faulted". After the signals of modules and buses are declared, and
  /// before the variables, on which no fault acts.
  void declare(const config::Scenario& scenario, signals::KnownSignals& known,
               config::Diagnostics& diagnostics);
  /// A reader that a fault names and that does not read its signal is a mistake, and so is a signal that
  /// nobody reads.
  void redirect(std::span<const Reader> readers, config::Diagnostics& diagnostics);
  void compile(const config::Scenario& scenario, const signals::KnownSignals& known,
               config::Diagnostics& diagnostics);

  /// Before the first tick. The table and the log outlive the last tick.
  void open(signals::SignalTable& table, modules::EventLog& events);
  /// After the inputs of devices are latched.
  void begin_tick(std::int64_t time_ns) noexcept;
  /// After all tasks.
  void end_tick(std::int64_t time_ns) noexcept;

  void fill(std::int64_t end_ns, report::RunRecord& record) const;

 private:
  class Chain;
  struct Fault;

  std::vector<std::unique_ptr<Fault>> faults_;  ///< in the order of the scenario
  std::vector<std::unique_ptr<Chain>> chains_;  ///< one for each faulted signal
  signals::SignalTable* table_ = nullptr;
  modules::EventLog* events_ = nullptr;
};

}  // namespace hil::injection
