#pragma once
// The signals of a run as names of expressions. An expression's values are those of the signals that it
// mentions, in the order of their first mention.
//
// Threads: as the table's; sample() neither allocates nor blocks.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/config/expression.hpp"
#include "runtime/expression/program.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::signals {

class SignalScope final : public expression::Scope {
 public:
  /// `known`: while the run is wired, so that a signal whose part has a mistake adds no second one; null
  /// afterwards. Both outlive the scope.
  SignalScope(const config::Expression& expression, const SignalTable& table,
              const KnownSignals* known = nullptr);

  std::optional<expression::Variable> find(std::string_view name) const override;
  std::vector<std::string> names() const override { return table_.names(); }
  bool is_broken(std::string_view name) const override;

  /// By Variable::index.
  const std::vector<SignalId>& signals() const noexcept { return signals_; }

 private:
  const SignalTable& table_;
  const KnownSignals* known_;
  std::vector<SignalId> signals_;
};

/// Whether an output has its initial value until its task has published it, or is unknown.
enum class Unpublished : std::uint8_t { initial_value, unknown };

/// When an expression is evaluated.
struct Instant {
  std::int64_t time_ns = 0;
  bool is_tick = true;  ///< false: a frame that came before the tick
};

/// Writes the values of the signals, and the run times at which they were written. A signal that is not known
/// has the value NaN, written at `time_s`. All spans have one size.
void sample(const SignalTable& table, std::span<const SignalId> signals, Unpublished unpublished,
            double time_s, std::span<double> values, std::span<expression::WriteTimes> written) noexcept;

}  // namespace hil::signals
