#pragma once
// The kinds of part of a stimulus (waveforms/table.def), and the port between a stimulus and a kind. A kind
// is immutable; what a part of it has in a run is kept by segments.hpp.
//
// Threads: kinds on any; compile on the one that wires the run; value and at_end on the base thread, without
// allocation.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/config/stimulus_section.hpp"
#include "runtime/injection/random_numbers.hpp"
#include "runtime/signals/signal_expression.hpp"

namespace hil::injection {

/// An expression of a part in a run.
struct WaveformExpression {
  signals::SignalExpression expression;
  double factor = 1.0;  ///< to the unit of the driven signal
  std::string unit{};   ///< of the expression
};

/// An instant of a part that has begun.
class WaveformInstant {
 public:
  WaveformInstant(std::span<WaveformExpression> expressions, const signals::SignalTable& table,
                  std::int64_t time_ns, RandomNumbers& numbers) noexcept
      : random(numbers), expressions_(expressions), table_(table), time_ns_(time_ns) {}

  std::span<const double> values{};  ///< of its expressions at its begin
  double before = 0.0;               ///< the value before the part
  std::int64_t passed_ns = 0;        ///< since its begin
  std::int64_t for_ns = 0;           ///< its duration; the largest number: to the end of the run
  RandomNumbers& random;             ///< of the stimulus

  /// The value of an expression now. Advances functions with a memory: once in each instant.
  double evaluate(std::size_t expression) const noexcept {
    return expressions_[expression].expression.evaluate(table_, time_ns_,
                                                        signals::Unpublished::initial_value) *
           expressions_[expression].factor;
  }

 private:
  std::span<WaveformExpression> expressions_;
  const signals::SignalTable& table_;
  std::int64_t time_ns_;
};

/// Compiles the expressions of a part. Value names of the driven signal stand for their values.
class WaveformCompiler {
 public:
  /// `seed`: of the expressions before; changed by each one.
  WaveformCompiler(const signals::KnownSignals& known, const signals::SignalInfo& driven,
                   std::int64_t period_ns, std::uint64_t& seed, config::Diagnostics& diagnostics)
      : diagnostics_(diagnostics), known_(known), driven_(driven), period_ns_(period_ns), seed_(seed) {}

  // False with a mistake.
  /// Adds an expression in the unit of the driven signal.
  bool add_value(const config::Expression& expression) { return add(expression, false); }
  /// Adds an expression for a difference of two values of the driven signal.
  bool add_difference(const config::Expression& expression) { return add(expression, true); }

  /// A mistake of the last expression: a sentence that follows the name of the driven signal.
  void refuse_last(const config::Place& place, const std::string& sentence) {
    diagnostics_.add(place, "'" + driven_.name + "': " + sentence);
  }
  const WaveformExpression& last() const noexcept { return expressions_.back(); }
  std::vector<WaveformExpression> take() noexcept { return std::move(expressions_); }

 private:
  bool add(const config::Expression& expression, bool is_difference);

  config::Diagnostics& diagnostics_;
  const signals::KnownSignals& known_;
  const signals::SignalInfo& driven_;
  const std::int64_t period_ns_;
  std::uint64_t& seed_;
  std::vector<WaveformExpression> expressions_;
};

/// What the kinds of part derive their waveforms from.
class Waveform : public config::Waveform {
 public:
  explicit Waveform(std::vector<config::Expression> expressions) : expressions_(std::move(expressions)) {}
  std::vector<config::Expression> expressions() const override { return expressions_; }

  /// Adds its expressions. False with mistakes. Default: each in the unit of the driven signal.
  virtual bool compile(WaveformCompiler& compiler) const;
  /// The value at an instant: at its begin, and then in each tick.
  virtual double value(const WaveformInstant& part) const noexcept = 0;
  /// The value of the part at its end. `last`: that of the last tick. `values`: of its expressions at its
  /// begin.
  virtual double at_end(double last, std::span<const double> values) const noexcept {
    static_cast<void>(values);
    return last;
  }

 protected:
  const config::Expression& expression(std::size_t index) const noexcept { return expressions_[index]; }

 private:
  std::vector<config::Expression> expressions_;
};

/// A waveform with these expressions. Null: one of them has a mistake.
template <class Kind, class... Parameters>
std::shared_ptr<const config::Waveform> waveform_of(std::vector<std::optional<config::Expression>> texts,
                                                    Parameters... parameters) {
  std::vector<config::Expression> expressions;
  for (std::optional<config::Expression>& text : texts) {
    if (!text) return nullptr;
    expressions.push_back(std::move(*text));
  }
  return std::make_shared<const Kind>(std::move(expressions), parameters...);
}

/// All kinds (waveforms/table.def), for config::load_scenario.
config::Waveforms waveforms();
/// The waveform of test tables (waveforms/hold.cpp).
std::shared_ptr<const config::Waveform> held(config::Expression value);

}  // namespace hil::injection
