#pragma once
// Stimuli: signals that drive inputs of modules and outputs of buses. The signal of a stimulus has the name
// of what it drives, "control.setpoint", and is written at the begin of each tick. "stimulus.NAME" is 1 while
// it is active. Before it begins, and after it has ended, the signal keeps its value: at first that of the
// input without a signal, or the safe value of the output.
//
// Threads: declare and compile on the one that wires the run; begin_tick on the base thread, without
// allocation; fill after the run.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <hil/event_log.hpp>

#include "runtime/config/scenario.hpp"
#include "runtime/injection/activation.hpp"
#include "runtime/injection/segments.hpp"
#include "runtime/injection/stimulus_effect.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/signals/csv_profile.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::injection {

/// An input of a module or an output of a bus that a stimulus may drive.
struct Target {
  std::string name;  ///< "control.setpoint", "can.car.EgoStatus.Speed"
  std::string unit;
  double initial = 0.0;
  std::int64_t period_ns = 0;           ///< of the task or the frames that read it
  signals::SignalId* signal = nullptr;  ///< what it reads; invalid: nothing drives it yet
};

class Stimuli {
 public:
  /// Adds "stimulus.NAME", and the signals of the targets, which are known before anything is connected.
  void declare(const config::Scenario& scenario, signals::KnownSignals& known,
               std::span<const Target> targets, config::Diagnostics& diagnostics);
  /// Connects the targets. A target that something else drives is a mistake.
  void connect(std::span<const Target> targets, signals::SignalTable& table,
               config::Diagnostics& diagnostics);
  void compile(const config::Scenario& scenario, const signals::KnownSignals& known,
               config::Diagnostics& diagnostics);

  /// Before the first tick. The table and the log outlive the last tick.
  void open(signals::SignalTable& table, modules::EventLog& events);
  void begin_tick(std::int64_t time_ns) noexcept;

  void fill(std::int64_t end_ns, report::RunRecord& record) const;

 private:
  struct Stimulus {
    const config::StimulusSection* section = nullptr;
    signals::SignalId active{};  ///< the signal "stimulus.NAME"
    signals::SignalId driven{};  ///< invalid: it has a mistake
    std::optional<Activation> activation{};
    std::unique_ptr<Segments> segments{};         ///< or
    std::unique_ptr<signals::CsvProfile> file{};  ///< one of them, unless it has a mistake
    modules::EventLog::Kind begins{}, ends{};
    std::vector<std::optional<modules::EventLog::Kind>> parts{};  ///< by segment: of those with a name
    std::int64_t began_ns = 0;
    std::unique_ptr<StimulusEffect> effect{};
    std::int64_t reader_period_ns = 0;
  };
  /// Why it took no effect, as a clause for the report; empty: it did, as far as it began.
  static std::string missing_effect(const Stimulus& stimulus);

  std::vector<Stimulus> stimuli_;
  signals::SignalTable* table_ = nullptr;
  modules::EventLog* events_ = nullptr;
};

}  // namespace hil::injection
