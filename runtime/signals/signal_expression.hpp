#pragma once
// A compiled expression over the signals of a run.
//
// Threads: compile on the one that wires the run; evaluate as the table's, without allocation.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "runtime/config/expression.hpp"
#include "runtime/expression/program.hpp"
#include "runtime/signals/known_signals.hpp"
#include "runtime/signals/signal_scope.hpp"

namespace hil::signals {

/// The signals that the expression names, each once.
std::vector<SignalId> signals_in(const config::Expression& expression, const SignalTable& table);

class SignalExpression {
 public:
  /// Empty with mistakes, all of them; without one where the mistake of a name is reported elsewhere. Adds
  /// the warnings of the signals that it reads. A constant without a value (0 / 0) is a mistake.
  static std::optional<SignalExpression> compile(const config::Expression& expression,
                                                 const KnownSignals& known,
                                                 const expression::ResultSpec& spec,
                                                 const expression::CompileOptions& options,
                                                 config::Diagnostics& diagnostics);

  /// The same, while the run goes on, for an expression that was compiled when it was wired.
  static std::optional<SignalExpression> compile(const config::Expression& expression,
                                                 const SignalTable& table, const expression::ResultSpec& spec,
                                                 const expression::CompileOptions& options,
                                                 config::Diagnostics& diagnostics);

  /// NaN: unknown. Advances functions with a memory.
  double evaluate(const SignalTable& table, Instant instant, Unpublished unpublished) noexcept;
  double evaluate(const SignalTable& table, std::int64_t time_ns, Unpublished unpublished) noexcept {
    return evaluate(table, Instant{.time_ns = time_ns}, unpublished);
  }
  /// The result in every step (Program::value_in_all_steps), where the signals of `known` with a constant
  /// value have it. Null: none has one.
  double value_in_all_steps(const KnownSignals* known) noexcept;
  /// Run times of the newest and the oldest written value on which the latest result depends: 4e18 ns
  /// in the past and the future of a constant.
  std::int64_t newest_ns() const noexcept { return nanoseconds(program_.written().newest_s); }
  std::int64_t oldest_ns() const noexcept { return nanoseconds(program_.written().oldest_s); }

  /// Compiled with known signals: its value where that is the same in each step.
  std::optional<double> constant() const noexcept { return constant_; }
  const std::string& unit() const noexcept { return program_.unit(); }
  units::ValueKind value_kind() const noexcept { return program_.value_kind(); }
  /// Those that it reads, in the order of their first mention.
  const std::vector<SignalId>& signals() const noexcept { return signals_; }

 private:
  static std::optional<SignalExpression> compile(const config::Expression& expression,
                                                 const SignalScope& scope, const expression::ResultSpec& spec,
                                                 const expression::CompileOptions& options,
                                                 config::Diagnostics& diagnostics);
  /// Whether its value is the same in each step.
  bool is_constant(const config::Expression& expression) const;
  SignalExpression(expression::Program program, std::vector<SignalId> signals)
      : program_(std::move(program)),
        signals_(std::move(signals)),
        values_(signals_.size()),
        written_(signals_.size()) {}
  static std::int64_t nanoseconds(double time_s) noexcept;

  expression::Program program_;
  std::vector<SignalId> signals_;
  std::vector<double> values_;
  std::vector<expression::WriteTimes> written_;
  std::optional<double> constant_;
};

}  // namespace hil::signals
