#pragma once
// The kinds of fault of a signal (signal_faults/table.def), and the port between a faulty signal and a
// kind. A kind declares its effect, which is immutable, and makes of it the action of a fault in a run.
//
// Threads: kinds on any; make on the one that wires the run; actions on the base thread, without allocation.

#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "runtime/config/fault_section.hpp"
#include "runtime/signals/signal_expression.hpp"
#include "runtime/signals/signal_table.hpp"

namespace hil::injection {

/// What one fault does to a signal in a run.
class SignalAction {
 public:
  virtual ~SignalAction() = default;
  /// In each tick, active or not, so that its random numbers do not depend on when it is active.
  virtual void begin_tick(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
    static_cast<void>(table), static_cast<void>(time_ns);
  }
  /// The fault begins in this tick.
  virtual void begin(std::int64_t time_ns) noexcept { static_cast<void>(time_ns); }
  /// While the fault is active: at each write of the signal, and at the end of the tick.
  virtual void act_on(signals::SignalValue& signal, std::int64_t time_ns) noexcept = 0;
  /// At the end of each tick, active or not: the value that comes to it.
  virtual void keep(const signals::SignalValue& signal, std::int64_t time_ns) noexcept {
    static_cast<void>(signal), static_cast<void>(time_ns);
  }

  // Of this tick, while the fault is active.
  /// False: values pass as they are.
  virtual bool acts() const noexcept { return true; }
  /// Whether its result does not depend on what comes to it now: the true value, changed by earlier faults.
  virtual bool replaces_value() const noexcept { return false; }
  /// Whether its result is the value from before its begin.
  virtual bool holds_last_value() const noexcept { return false; }
  /// Whether it does not know what to do, since its own value is unknown.
  virtual bool is_unknown() const noexcept { return false; }
};

/// What the value of a fault is in.
struct FaultValueUnit {
  std::string symbol;
  double factor = 1.0;         ///< to the unit of the signal
  bool is_difference = false;  ///< of two values
  bool is_rate = false;        ///< per second
};
/// Of what is added to a signal in this unit.
FaultValueUnit added_value_unit(const std::string& unit_of_signal);

/// The value of a fault in a run: an expression.
class FaultValue {
 public:
  FaultValue(signals::SignalExpression expression, FaultValueUnit unit)
      : expression_(std::move(expression)), unit_(std::move(unit)) {}

  /// In the unit of the signal. NaN: unknown.
  double evaluate(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
    return expression_.evaluate(table, time_ns, signals::Unpublished::initial_value) * unit_.factor;
  }
  /// Empty: it varies.
  std::optional<double> constant() const noexcept { return expression_.constant(); }
  const FaultValueUnit& unit() const noexcept { return unit_; }

 private:
  signals::SignalExpression expression_;
  FaultValueUnit unit_;
};

/// What a fault acts on, and the seeds of its random numbers.
struct SignalFaultContext {
  const config::FaultSection& section;
  const signals::SignalInfo& signal;
  const signals::KnownSignals& known;
  std::int64_t base_period_ns = 0;
  std::uint64_t seed = 0;             ///< of the action
  std::uint64_t expression_seed = 0;  ///< of its expression
  config::Diagnostics& diagnostics;

  /// Empty with mistakes. `named_values`: names of values that stand for them.
  std::optional<FaultValue> compile(const config::Expression& value, FaultValueUnit unit,
                                    const std::map<std::string, double>& named_values = {}) const;
  /// A mistake of the value: a sentence that follows the name of the fault.
  void refuse(const config::Expression& value, const std::string& sentence) const {
    diagnostics.add(value.place(), "fault '" + section.name.text + "'" + sentence);
  }
  /// A mistake where the value is always the one with which the fault changes nothing.
  void refuse_without_effect(const config::Expression& value, const FaultValue& compiled,
                             double without_effect) const;
};

/// What the kinds derive their effects from.
class SignalFault : public config::FaultEffect {
 public:
  /// Null with mistakes.
  virtual std::unique_ptr<SignalAction> make(const SignalFaultContext& context) const = 0;
};

/// An effect that has one expression as its value.
class ValueFault : public SignalFault {
 public:
  explicit ValueFault(config::Expression value) : value_(std::move(value)) {}
  std::vector<config::Expression> expressions() const override { return {value_}; }

 protected:
  const config::Expression& value() const noexcept { return value_; }

 private:
  config::Expression value_;
};

/// An action with a value, which is computed in each tick.
class ValueAction : public SignalAction {
 public:
  explicit ValueAction(FaultValue value) : value_(std::move(value)) {}
  void begin_tick(const signals::SignalTable& table, std::int64_t time_ns) noexcept override {
    number_ = value_.evaluate(table, time_ns);
  }
  bool is_unknown() const noexcept override { return std::isnan(number_); }

 protected:
  double number_ = 0.0;  ///< the value in this tick

 private:
  FaultValue value_;
};

/// Of kinds whose value is an expression: FaultKind::read and FaultKind::read_cell.
template <class Fault>
std::shared_ptr<const config::FaultEffect> read_value_fault(const config::Value& value,
                                                            const config::FaultContext& context) {
  auto expression = config::Expression::parse(value, context.diagnostics);
  return expression ? std::make_shared<const Fault>(std::move(*expression)) : nullptr;
}
template <class Fault>
std::shared_ptr<const config::FaultEffect> read_value_cell(const config::Word& value,
                                                           config::Diagnostics& diagnostics) {
  auto expression = config::Expression::parse(value, diagnostics);
  return expression ? std::make_shared<const Fault>(std::move(*expression)) : nullptr;
}

/// All kinds (signal_faults/table.def), for config::load_scenario.
const std::vector<config::FaultKind>& signal_fault_kinds();

}  // namespace hil::injection
