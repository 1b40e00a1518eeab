#pragma once
// The functions of expressions; docs/guide/expressions.md describes them.
//
// Threads: constant data and pure functions, but for the state that they are given.

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string_view>

namespace hil::expression {

/// What a function knows besides its arguments.
struct FunctionConstants {
  double period_s = 0.0;
  std::uint64_t seed = 0;  ///< of this call
};

/// Run times at which the signals of a value were written: the newest and the oldest of them. Of a constant
/// the newest is far in the past, and the oldest far in the future.
struct WriteTimes {
  double newest_s = std::numeric_limits<double>::lowest();
  double oldest_s = std::numeric_limits<double>::max();
};

/// A call in a step. `state`: of this call; all zero before the first step.
struct Call {
  std::span<const double> arguments;  ///< in the SI; truths as 1, 0 or NaN
  std::span<double> state;
  FunctionConstants constants;
  double time_s = 0.0;
  double elapsed_s = 0.0;  ///< since the step before; 0 in the first step
  /// Of the first argument; empty: each step writes all signals.
  std::optional<WriteTimes> written{};
  /// Gets whether the result is only a lower bound, since a part of the past is unknown.
  bool& is_lower_bound;
};

/// How a function is called, as text: the kinds of its arguments and of its result, "qqq:q".
///   q  a quantity; all q of a signature have one dimension
///   r  a quantity of any dimension; the result R has the square root of it
///   1  a plain number; an angle or a share counts in the SI
///   n  a plain number, and no angle and no share
///   t  a truth
///   s  a duration
///   S  a duration that is a constant
///   v  a change of q in time: q per second
///   p  a quantity of any dimension; the result P is its sum over time
/// In brackets: arguments that can be left out. "+" repeats the argument before it any number of times. "pid"
/// alone: a rule of its own (call_type.cpp).
struct Function {
  std::string_view name;
  std::string_view signature;
  std::uint32_t state_size = 0;      ///< of a call
  bool state_per_period = false;     ///< and a value for each period of the constant duration
  bool per_tick = false;             ///< keeps its result at frames between two ticks
  bool reports_known = false;        ///< its result is whether the argument is known
  bool may_be_lower_bound = false;   ///< its result, of a past that is partly unknown
  bool follows_writes = false;       ///< has a new result only where an argument has a new value
  bool takes_difference = false;     ///< a number in degrees is a difference of temperatures
  bool needs_absolute_zero = false;  ///< its result depends on where the scale begins: no point in degC
  double (*value)(const Call& call) noexcept = nullptr;
  /// Why the constant arguments are not valid, as a clause: "its low is above its high"; empty: they are
  /// valid. An argument that is no constant is NaN. Null: all are valid.
  std::string_view (*problem)(std::span<const double> constants) = nullptr;
  std::string_view arguments;  ///< for documentation: "x, low, [high]"
  std::string_view about;
};

std::span<const Function> functions();

}  // namespace hil::expression
