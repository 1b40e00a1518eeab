#include "runtime/expression/program.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <type_traits>

#include <hil/require.hpp>

namespace hil::expression {
namespace {

constexpr double unknown_value = std::numeric_limits<double>::quiet_NaN();

WriteTimes joined(const WriteTimes& a, const WriteTimes& b) {
  return {.newest_s = std::max(a.newest_s, b.newest_s), .oldest_s = std::min(a.oldest_s, b.oldest_s)};
}

/// `decisive`: the value of either operand that decides the result.
double joined(double a, double b, double decisive) {
  if (a == decisive || b == decisive) return decisive;
  return std::isnan(a) || std::isnan(b) ? unknown_value : 1.0 - decisive;
}

template <typename Comparison>
double compared(double a, double b, Comparison comparison) {
  if (std::isnan(a) || std::isnan(b)) return unknown_value;
  return comparison(a, b) ? 1.0 : 0.0;
}

}  // namespace

double Program::evaluate(std::span<const double> values, const EvaluationTime& at) noexcept {
  return run(values, at, at.is_tick ? MemoryMode::advance : MemoryMode::advance_except_per_tick);
}

double Program::evaluate_between_steps(std::span<const double> values, double time_s) noexcept {
  return run(values, EvaluationTime{.time_s = time_s}, MemoryMode::keep);
}

double Program::value_in_all_steps(std::span<const double> values) noexcept {
  return run(values, EvaluationTime{.time_s = unknown_value}, MemoryMode::unknown);
}

void Program::reset() noexcept {
  std::ranges::fill(state_, 0.0);
  std::ranges::fill(last_results_, Operand{});
  last_time_s_.reset();
}

double Program::exact(const Operand& operand) noexcept {
  return operand.is_lower_bound ? unknown_value : operand.value;
}

template <typename Comparison>
bool Program::is_decided(const Operand& a, const Operand& b, Comparison comparison,
                         bool is_equality) noexcept {
  if (!a.is_lower_bound && !b.is_lower_bound) return true;
  const auto largest = [](const Operand& operand) {
    return operand.is_lower_bound ? std::numeric_limits<double>::infinity() : operand.value;
  };
  const bool reaches = is_equality && (a.is_lower_bound ? a.value <= b.value : b.value <= a.value);
  return a.is_lower_bound != b.is_lower_bound && !reaches &&
         compared(largest(a), largest(b), comparison) == compared(a.value, b.value, comparison);
}

template <class AnyOperand>
AnyOperand* Program::operate(config::Expression::Operation operation, AnyOperand* top) noexcept {
  using Operation = config::Expression::Operation;
  constexpr bool is_plain = std::is_same_v<AnyOperand, PlainOperand>;
  const auto binary = [&](auto function) {
    --top;
    top[-1].value = function(exact(top[-1]), exact(top[0]));
    if constexpr (!is_plain) {
      top[-1].written = joined(top[-1].written, top[0].written);
      top[-1].is_lower_bound = false;
    }
  };
  // A lower bound decides a comparison that has one result for all values from the bound on.
  const auto compare = [&](auto comparison, bool is_equality = false) {
    double result = compared(top[-2].value, top[-1].value, comparison);
    if constexpr (!is_plain) {
      if (!is_decided(top[-2], top[-1], comparison, is_equality)) result = unknown_value;
    }
    binary([&](double, double) { return result; });
  };
  switch (operation) {
    case Operation::any_of:
      binary([](double a, double b) { return joined(a, b, 1.0); });
      break;
    case Operation::all_of:
      binary([](double a, double b) { return joined(a, b, 0.0); });
      break;
    case Operation::negation:
      top[-1].value = 1.0 - top[-1].value;
      break;
    case Operation::equal:
      compare(std::equal_to<>(), true);
      break;
    case Operation::not_equal:
      compare(std::not_equal_to<>(), true);
      break;
    case Operation::less:
      compare(std::less<>());
      break;
    case Operation::less_or_equal:
      compare(std::less_equal<>());
      break;
    case Operation::greater:
      compare(std::greater<>());
      break;
    case Operation::greater_or_equal:
      compare(std::greater_equal<>());
      break;
    case Operation::add:
      if constexpr (is_plain) {
        binary(std::plus<>());
      } else {
        const double sum = top[-2].value + top[-1].value;
        const bool is_lower_bound = top[-2].is_lower_bound || top[-1].is_lower_bound;
        binary([&](double, double) { return sum; });
        top[-1].is_lower_bound = is_lower_bound;
      }
      break;
    case Operation::subtract:
      binary(std::minus<>());
      break;
    case Operation::multiply:
      binary(std::multiplies<>());
      break;
    case Operation::divide:
      binary([](double a, double b) { return b == 0.0 ? unknown_value : a / b; });
      break;
    case Operation::minus:
      top[-1].value = -exact(top[-1]);
      if constexpr (!is_plain) top[-1].is_lower_bound = false;
      break;
    case Operation::power:
      binary([](double a, double b) { return std::pow(a, b); });
      break;
    case Operation::conditional: {
      top -= 2;
      const AnyOperand condition = top[-1], yes = top[0], no = top[1];
      if (std::isnan(condition.value))
        top[-1] = {.value = unknown_value};
      else
        top[-1] = condition.value != 0.0 ? yes : no;
      if constexpr (!is_plain) {
        // The value is that of one branch, so only its signals have to be written anew.
        top[-1].written = {
            .newest_s = std::max({condition.written.newest_s, yes.written.newest_s, no.written.newest_s}),
            .oldest_s = condition.value == 0.0 ? no.written.oldest_s : yes.written.oldest_s};
      }
      break;
    }
    case Operation::number:
    case Operation::truth:
    case Operation::name:
    case Operation::quoted:
    case Operation::call:
      config::require(false, "an operation on the stack");
      break;
  }
  return top;
}

template <class AnyOperand>
AnyOperand Program::call(const Instruction& instruction, std::span<const AnyOperand> arguments,
                         const EvaluationTime& at, double elapsed_s, MemoryMode mode) noexcept {
  constexpr bool is_plain = std::is_same_v<AnyOperand, PlainOperand>;
  const Function& function = *instruction.function;
  const bool has_state = instruction.state_size > 0;
  if (mode == MemoryMode::unknown && (has_state || function.reports_known)) return {.value = unknown_value};
  if (has_state &&
      (mode == MemoryMode::keep || (mode == MemoryMode::advance_except_per_tick && function.per_tick))) {
    const Operand& last = last_results_[instruction.last_result];
    if constexpr (is_plain)
      return {.value = last.value};
    else
      return last;
  }
  Operand result;
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    arguments_[i] = exact(arguments[i]);
    if constexpr (!is_plain) result.written = joined(result.written, arguments[i].written);
  }
  Call call{.arguments = std::span(arguments_).first(arguments.size()),
            .state = std::span(state_).subspan(instruction.first_state, instruction.state_size),
            .constants = instruction.constants,
            .time_s = at.time_s,
            .elapsed_s = elapsed_s,
            .is_lower_bound = result.is_lower_bound};
  if constexpr (!is_plain) {
    if (at.written) call.written = arguments[0].written;
  }
  result.value = function.value(call);
  if (has_state) {
    if (!function.follows_writes) result.written = {.newest_s = at.time_s, .oldest_s = at.time_s};
    last_results_[instruction.last_result] = result;
  }
  if constexpr (is_plain)
    return {.value = result.value};
  else
    return result;
}

double Program::run(std::span<const double> values, const EvaluationTime& at, MemoryMode mode) noexcept {
  return at.written || may_have_lower_bound_ ? run_on(stack_, values, at, mode)
                                             : run_on(plain_stack_, values, at, mode);
}

template <class AnyOperand>
double Program::run_on(std::vector<AnyOperand>& stack, std::span<const double> values,
                       const EvaluationTime& at, MemoryMode mode) noexcept {
  constexpr bool is_plain = std::is_same_v<AnyOperand, PlainOperand>;
  const auto operand = [](double value, [[maybe_unused]] const WriteTimes& written) {
    if constexpr (is_plain)
      return PlainOperand{.value = value};
    else
      return Operand{.value = value, .written = written};
  };
  config::require(!instructions_.empty(), "a program made by Program::compile");
  config::require(values.size() >= min_values_, "a value for each variable of the expression");
  const WriteTimes now{.newest_s = at.time_s, .oldest_s = at.time_s};
  double elapsed_s = 0.0;
  if (mode == MemoryMode::advance || mode == MemoryMode::advance_except_per_tick) {
    // Times are whole nanoseconds.
    if (last_time_s_) elapsed_s = std::round((at.time_s - *last_time_s_) * 1e9) / 1e9;
    last_time_s_ = at.time_s;
  }
  AnyOperand* top = stack.data();  // behind the last operand
  for (const Instruction& instruction : instructions_) {
    switch (instruction.code) {
      case Code::number:
        *top++ = operand(instruction.number, WriteTimes{});
        break;
      case Code::variable:
        *top++ = operand(instruction.conversion.of(values[instruction.index]),
                         at.written ? (*at.written)[instruction.index] : now);
        break;
      case Code::time:
        *top++ = operand(at.time_s, now);
        break;
      case Code::operation:
        top = operate(instruction.operation, top);
        break;
      case Code::truth_of_number: {
        bool is_unknown = std::isnan(top[-1].value);
        if constexpr (!is_plain) {
          is_unknown = is_unknown || (top[-1].is_lower_bound && top[-1].value <= 0.0);
          top[-1].is_lower_bound = false;
        }
        top[-1].value = is_unknown ? unknown_value : top[-1].value != 0.0 ? 1.0 : 0.0;
        break;
      }
      case Code::convert:
        top[-1].value = instruction.conversion.of(top[-1].value);
        break;
      case Code::call:
        top -= instruction.arguments;
        *top =
            call(instruction, std::span<const AnyOperand>(top, instruction.arguments), at, elapsed_s, mode);
        ++top;
        break;
      case Code::table: {
        top -= instruction.arguments;
        const bool is_curve = instruction.arguments == 1;
        top[0].value = is_curve ? instruction.table->at(exact(top[0]))
                                : instruction.table->at(exact(top[0]), exact(top[1]));
        if constexpr (!is_plain) {
          if (!is_curve) top[0].written = joined(top[0].written, top[1].written);
          top[0].is_lower_bound = false;
        }
        ++top;
        break;
      }
    }
  }
  const double result = exact(top[-1]);
  if (!std::isfinite(result)) return unknown_value;
  return to_result_unit_.of(result);
}

}  // namespace hil::expression
