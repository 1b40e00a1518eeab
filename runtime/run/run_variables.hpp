#pragma once
// The variables of a scenario: signals whose values are computed at the end of each tick, from the signals of
// this tick and from variables before them.
//
// Threads: declare on the one that wires the run; update on the base thread, where it neither allocates nor
// blocks.

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/expectations/computed_signals.hpp"
#include "runtime/signals/known_signals.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::run {

class RunVariables final : public expectations::ComputedSignals {
 public:
  /// Adds the signals, whose initial values are those before the first tick. Adds the mistakes of all
  /// expressions. After all other signals are declared.
  void declare(const config::Scenario& scenario, signals::KnownSignals& known,
               config::Diagnostics& diagnostics);

  /// At the end of a tick.
  void update(signals::SignalTable& table, std::int64_t time_ns) noexcept;
  void update_at_frame(signals::SignalTable& table, std::int64_t time_ns,
                       std::span<const std::uint32_t> numbers) noexcept override;
  std::vector<std::uint32_t> numbers_reading(std::span<const signals::SignalId> signals) const override;
  std::vector<signals::SignalId> with_sources(std::vector<signals::SignalId> signals) const override;

  struct Variable {
    signals::SignalId signal;
    signals::SignalExpression expression;
  };
  /// In the order in which they are computed.
  const std::vector<Variable>& all() const noexcept { return variables_; }

 private:
  void update(Variable& variable, signals::SignalTable& table, signals::Instant instant) noexcept;

  std::vector<Variable> variables_;
};

}  // namespace hil::run
