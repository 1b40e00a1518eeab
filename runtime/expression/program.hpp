#pragma once
// A compiled expression (config/expression.hpp): its names are resolved, its units are checked, and it is
// evaluated step by step without allocation.
//
// Units. Values are computed in the SI. A name has the unit of its signal; a name without a unit is a plain
// number. Operands of +, -, comparisons, and functions of like values have one dimension. A number without a
// unit takes the unit of the operand beside it: with `speed` in km/h, `speed > 50` compares with 50 km/h.
// Where that operand is itself computed from different units, or the unit has an offset (degC) and the number
// may be a difference, the number needs a unit. The result is converted to the required unit.
// A signal whose unit is none (units::parse_unit) is used like a plain number. A value in K is a temperature
// (a point) or a difference of two; a rate counts radians, turns or cycles (units/unit.hpp).
//
// Truth. Comparisons, and, or, not and some functions are true or false. A plain number counts as true where
// it is not 0. As a number true is 1.
//
// Unknown. NaN is a value that is not known: of a signal that is not fresh, or of an operation without a
// result (0 / 0). Numbers that depend on it are unknown. So are comparisons; and, or and not follow Kleene's
// three-valued logic: false and unknown is false. A count of which a part of the past is unknown is a lower
// bound. `+`, `if` and a conversion of units keep a lower bound. A comparison, or the bound as a condition,
// is known if it has one result for all values from the bound on. Every other operation on it is unknown, and
// so is an expression with it as its result.
//
// Functions: function.cpp lists them. Some have a state, which each step advances: a program belongs to one
// place that evaluates it in each step. They go by run time: a step that was left out has the values of the
// step before it.
//
// Threads: compile on any; a program on one at a time. evaluate neither allocates nor blocks.

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/unit.hpp>

#include "runtime/config/expression.hpp"
#include "runtime/expression/function.hpp"
#include "runtime/expression/table.hpp"

namespace hil::expression {

/// A name that an expression may use.
struct Variable {
  std::uint32_t index = 0;  ///< in the values of evaluate
  std::string unit{};       ///< of the value; "" for a plain number
  /// Value names, as a bus describes them; NaN: several values have the name. May be null.
  const std::map<std::string, double>* named_values = nullptr;
  /// What has the value names has a mistake, so any name is accepted.
  bool accepts_any_name = false;
  units::ValueKind value_kind = units::ValueKind::as_unit;
  /// It comes from a device, and nothing gives it a unit: beside one that is not of the SI it adds a warning.
  bool lacks_unit = false;
  std::optional<double> constant{};  ///< its value in each step, where the scenario makes it so
};

/// The names that an expression may use. `time`, the run time in seconds, is one of all expressions.
class Scope {
 public:
  virtual ~Scope() = default;
  /// Empty: there is none of that name.
  virtual std::optional<Variable> find(std::string_view name) const = 0;
  /// For suggestions, where a name is not found.
  virtual std::vector<std::string> names() const = 0;
  /// Whether the name is not found since its definition has a mistake, so that its use adds no other one.
  virtual bool is_broken(std::string_view /*name*/) const { return false; }
  /// Null: there is none of that name. A table outlives the programs that call it.
  virtual const Table* find_table(std::string_view /*name*/) const { return nullptr; }
  virtual std::vector<std::string> table_names() const { return {}; }
  /// What names stand for, in error texts.
  virtual std::string noun() const { return "signal"; }
};

/// The result that the reader of an expression needs.
struct ResultSpec {
  bool truth = false;  ///< true or false; otherwise a number in `unit`
  /// Empty: the result has the unit of the expression (Program::unit), and may be true or false.
  std::optional<std::string> unit = "";
  bool is_difference = false;  ///< of two values: in K, a difference of temperatures
  bool is_rate = false;        ///< per second: in `unit` per second
  /// The expression and its unit in error texts: "the condition", "'level'".
  std::string what = "the expression";
};

struct CompileOptions {
  std::int64_t period_ns = 0;  ///< between two steps; functions of time need it
  std::uint64_t seed = 0;      ///< of noise: different for each expression of a run
};

/// When a program is evaluated, and the run times at which the values of its variables were written.
struct EvaluationTime {
  double time_s = 0.0;
  /// By Variable::index, as many as `values`; empty: each step writes all of them.
  std::optional<std::span<const WriteTimes>> written{};
  bool is_tick = true;  ///< false: a frame between two ticks
};

class Program {
 public:
  /// Empty with mistakes, all of them, at their places.
  static std::optional<Program> compile(const config::Expression& expression, const Scope& scope,
                                        const ResultSpec& spec, const CompileOptions& options,
                                        config::Diagnostics& diagnostics);

  /// The value in the required unit; of a truth 1, 0, or NaN if it is unknown. `values`: by Variable::index,
  /// in the units of the variables. Misuse (asserts): fewer values than the variables need.
  double evaluate(std::span<const double> values, const EvaluationTime& at) noexcept;
  double evaluate(std::span<const double> values, double time_s) noexcept {
    return evaluate(values, EvaluationTime{.time_s = time_s});
  }
  /// Evaluates without advancing: functions with a state return their last results.
  double evaluate_between_steps(std::span<const double> values, double time_s) noexcept;
  /// The result in every step, whatever is unknown: time, random numbers, the results of functions with a
  /// memory and of known(), and the variables that are NaN in `values`. NaN: it depends on them.
  double value_in_all_steps(std::span<const double> values) noexcept;
  /// As before the first step.
  void reset() noexcept;
  /// Of the signals on which the result of the last evaluate() depends. Valid only if its time had `written`.
  const WriteTimes& written() const noexcept { return stack_.front().written; }

  /// Unit of the results of evaluate(); "" of plain numbers and truths.
  const std::string& unit() const noexcept { return unit_; }
  /// What kind of value the results are in that unit.
  units::ValueKind value_kind() const noexcept { return value_kind_; }
  /// Indices of the variables that it reads, ascending, each once.
  const std::vector<std::uint32_t>& variables() const noexcept { return variables_; }
  bool has_state() const noexcept { return !state_.empty(); }

 private:
  friend class Compiler;
  enum class Code : std::uint8_t {
    number,
    variable,
    time,
    operation,
    truth_of_number,
    convert,
    call,
    table,
  };
  /// Takes its operands from the stack and appends its result.
  struct Instruction {
    Code code = Code::number;
    config::Expression::Operation operation{};  ///< operation: with two operands, a sign, not or if
    double number = 0.0;                        ///< number
    std::uint32_t index = 0;                    ///< variable
    units::Conversion conversion{};             ///< variable, convert
    const Function* function = nullptr;         ///< call
    const Table* table = nullptr;               ///< table
    std::uint32_t arguments = 0;                ///< call, table
    std::uint32_t first_state = 0;              ///< call: of a function with a state
    std::uint32_t state_size = 0;
    std::uint32_t last_result = 0;  ///< call: of a function with a state, its place in last_results_
    FunctionConstants constants{};  ///< call
  };
  struct Operand {
    double value = 0.0;
    WriteTimes written{};         ///< of the signals that it depends on
    bool is_lower_bound = false;  ///< the value is at least this
  };
  /// What an evaluation does with functions with a state.
  enum class MemoryMode : std::uint8_t {
    advance,                  ///< a tick: all of them advance
    advance_except_per_tick,  ///< a frame: those of Function::per_tick return their last results
    keep,                     ///< all return their last results
    unknown,                  ///< their results are unknown (value_in_all_steps)
  };

  /// An operand where each step writes all values, and nothing is a lower bound.
  struct PlainOperand {
    double value = 0.0;
  };

  /// The value; NaN of a lower bound.
  static double exact(const Operand& operand) noexcept;
  static double exact(const PlainOperand& operand) noexcept { return operand.value; }
  /// Whether a comparison has one result for all values from lower bounds on.
  template <typename Comparison>
  static bool is_decided(const Operand& a, const Operand& b, Comparison comparison,
                         bool is_equality) noexcept;
  /// Replaces the operands before `top` by the result, and returns the new top.
  template <class AnyOperand>
  static AnyOperand* operate(config::Expression::Operation operation, AnyOperand* top) noexcept;
  template <class AnyOperand>
  AnyOperand call(const Instruction& instruction, std::span<const AnyOperand> arguments,
                  const EvaluationTime& at, double elapsed_s, MemoryMode mode) noexcept;
  template <class AnyOperand>
  double run_on(std::vector<AnyOperand>& stack, std::span<const double> values, const EvaluationTime& at,
                MemoryMode mode) noexcept;
  double run(std::span<const double> values, const EvaluationTime& at, MemoryMode mode) noexcept;

  std::vector<Instruction> instructions_;
  std::vector<Operand> stack_;
  std::vector<PlainOperand> plain_stack_;
  bool may_have_lower_bound_ = false;
  std::vector<Operand> last_results_;  ///< of the functions with a state
  std::vector<double> state_;
  std::vector<double> arguments_;  ///< of a call
  std::optional<double> last_time_s_;
  std::vector<std::uint32_t> variables_;
  units::Conversion to_result_unit_{};
  std::string unit_;
  units::ValueKind value_kind_ = units::ValueKind::as_unit;
  std::uint32_t min_values_ = 0;
};

}  // namespace hil::expression
