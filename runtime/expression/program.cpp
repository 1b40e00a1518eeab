#include "runtime/expression/program.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

#include "runtime/config/require.hpp"

namespace hil::expression {
namespace {

constexpr double unknown_value = std::numeric_limits<double>::quiet_NaN();

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

double Program::evaluate(std::span<const double> values, double time_s) noexcept {
  return run(values, time_s, true);
}

double Program::evaluate_between_steps(std::span<const double> values, double time_s) noexcept {
  return run(values, time_s, false);
}

void Program::reset() noexcept {
  std::ranges::fill(state_, 0.0);
}

double* Program::operate(config::Expression::Operation operation, double* top) noexcept {
  using Operation = config::Expression::Operation;
  const auto binary = [&](auto function) {
    --top;
    top[-1] = function(top[-1], top[0]);
  };
  const auto compare = [&](auto comparison) {
    binary([&](double a, double b) { return compared(a, b, comparison); });
  };
  switch (operation) {
    case Operation::any_of:
      binary([](double a, double b) { return joined(a, b, 1.0); });
      break;
    case Operation::all_of:
      binary([](double a, double b) { return joined(a, b, 0.0); });
      break;
    case Operation::negation:
      top[-1] = 1.0 - top[-1];
      break;
    case Operation::equal:
      compare(std::equal_to<>());
      break;
    case Operation::not_equal:
      compare(std::not_equal_to<>());
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
      binary(std::plus<>());
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
      top[-1] = -top[-1];
      break;
    case Operation::power:
      binary([](double a, double b) { return std::pow(a, b); });
      break;
    case Operation::conditional:
      top -= 2;
      top[-1] = std::isnan(top[-1]) ? unknown_value : top[-1] != 0.0 ? top[0] : top[1];
      break;
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

double Program::run(std::span<const double> values, double time_s, bool is_step) noexcept {
  config::require(!instructions_.empty(), "a program made by Program::compile");
  config::require(values.size() >= min_values_, "a value for each variable of the expression");
  double* top = stack_.data();  // behind the last operand
  for (const Instruction& instruction : instructions_) {
    switch (instruction.code) {
      case Code::number:
        *top++ = instruction.number;
        break;
      case Code::variable:
        *top++ = instruction.conversion.of(values[instruction.index]);
        break;
      case Code::time:
        *top++ = time_s;
        break;
      case Code::operation:
        top = operate(instruction.operation, top);
        break;
      case Code::truth_of_number:
        top[-1] = std::isnan(top[-1]) ? unknown_value : top[-1] != 0.0 ? 1.0 : 0.0;
        break;
      case Code::convert:
        top[-1] = instruction.conversion.of(top[-1]);
        break;
      case Code::call: {
        top -= instruction.arguments;
        const std::span<const double> arguments(top, instruction.arguments);
        const bool has_state = instruction.state_size > 0;
        double* const last = has_state ? &state_[instruction.first_state - 1] : nullptr;
        const double result = has_state && !is_step
                                  ? *last
                                  : instruction.function->value(
                                        {.arguments = arguments,
                                         .state = std::span(state_).subspan(
                                             has_state ? instruction.first_state : 0, instruction.state_size),
                                         .constants = instruction.constants,
                                         .time_s = time_s});
        if (has_state) *last = result;
        *top++ = result;
        break;
      }
      case Code::table:
        top -= instruction.arguments;
        *top = instruction.arguments == 1 ? instruction.table->at(top[0])
                                          : instruction.table->at(top[0], top[1]);
        ++top;
        break;
    }
  }
  const double result = top[-1];
  return std::isfinite(result) ? to_wanted_.of(result) : unknown_value;
}

}  // namespace hil::expression
