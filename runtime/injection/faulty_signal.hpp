#pragma once
// What faults do to a signal: "x.faulted" follows "x" and is computed again at each write of it.
//
// Threads: made on the one that wires the run; the rest on the base thread, without allocation.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/config/fault_section.hpp"
#include "runtime/injection/activation.hpp"
#include "runtime/injection/delay_line.hpp"
#include "runtime/injection/random_numbers.hpp"
#include "runtime/signals/signal_expression.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::injection {

/// What the value of a fault is in.
struct FaultValueUnit {
  std::string symbol;
  double factor = 1.0;  ///< to the unit of the signal
};
FaultValueUnit fault_value_unit(config::FaultSection::Kind kind, const std::string& unit_of_signal);

/// One fault of a signal.
class SignalEffect {
 public:
  /// The section outlives it. `seed`: of its random numbers.
  SignalEffect(const config::FaultSection& section, std::int64_t base_period_ns, std::uint64_t seed);

  /// Of its value, which is multiplied by `factor`.
  void set_value(signals::SignalExpression value, double factor) {
    value_ = std::move(value);
    value_factor_ = factor;
  }
  void begin_tick(const signals::SignalTable& table, std::int64_t time_ns) noexcept;
  /// The fault begins in this tick.
  void begin(std::int64_t time_ns) noexcept;
  void end() noexcept { is_active_ = false; }
  void act_on(signals::SignalValue& signal, std::int64_t time_ns) noexcept;
  /// A later fault replaces what it did.
  void set_replaced() noexcept { changes_ = false; }
  /// Whether its result does not depend on what comes to it now: the true value, changed by earlier faults.
  bool replaces_value() const noexcept;
  bool is_stuck_at_last() const noexcept {
    return is_active_ && section_.kind == config::FaultSection::Kind::stuck_at_last;
  }
  /// A reader reads the value.
  void note_read() noexcept {
    was_read_ |= is_active_;
    took_effect_ |= changes_;
  }
  /// Whether a reader read a value while the fault was active, and one that it had changed.
  bool was_read() const noexcept { return was_read_; }
  bool took_effect() const noexcept { return took_effect_; }
  /// A delay keeps what comes to it at the end of a tick.
  void keep(const signals::SignalValue& signal, std::int64_t time_ns) noexcept {
    if (line_) line_->keep(signal, time_ns);
  }

 private:
  const config::FaultSection& section_;
  std::optional<signals::SignalExpression> value_;
  double value_factor_ = 1.0;
  RandomNumbers random_;
  std::optional<DelayLine> line_;
  bool is_active_ = false;
  std::int64_t began_ns_ = 0;

  // Of this tick.
  double number_ = 0.0;  ///< the value, with the noise drawn
  bool is_dropped_ = false;
  bool takes_last_ = false;  ///< the next value is the one that it is stuck at
  bool changes_ = false;     ///< the value that readers get
  signals::SignalValue last_;
  bool was_read_ = false, took_effect_ = false;
};

/// A signal with faults, which act one after the other. It observes the reads of the faulted signal.
class FaultySignal final : public signals::WriteFollower, public signals::ReadObserver {
 public:
  FaultySignal(signals::SignalId true_signal, signals::SignalId faulted_signal)
      : signal(true_signal), faulted(faulted_signal) {}

  const signals::SignalId signal, faulted;
  std::vector<const config::FaultSection*> sections;
  std::vector<SignalEffect*> effects;  ///< they outlive it
  std::vector<std::string> readers;    ///< for the report, with their periods

  /// Before the first tick. The table outlives the last tick.
  void open(signals::SignalTable& table) {
    table_ = &table;
    table.set_follower(signal, *this);
    true_signal_observers_ = table.read_observers({{signal}});
  }
  void begin_tick(std::int64_t time_ns) noexcept {
    time_ns_ = time_ns;
    follow(signal);
  }
  void follow(signals::SignalId signal) noexcept override;
  void note_read(signals::ReadBy by) noexcept override;
  void end_tick() noexcept;

 private:
  signals::SignalValue value_with_faults() noexcept;
  /// The effect of this number acts on the value with the earlier effects.
  void act_on(signals::SignalValue& value, std::size_t number) noexcept;

  signals::SignalTable* table_ = nullptr;
  std::int64_t time_ns_ = 0;
  /// Observers of the true signal: the readers also read it while no fault replaces its value.
  std::vector<signals::ReadObserver*> true_signal_observers_;
};

}  // namespace hil::injection
