#include "runtime/expression/call_type.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <hil/numbers.hpp>

#include "runtime/expression/relation.hpp"

namespace hil::expression {
namespace {

using config::in_quotes;
using units::Dimension;
using units::Unit;

/// The largest delay in steps.
constexpr double max_delay_steps = 1e6;
/// The most steps of all delays of a scenario together; a step takes 8 bytes.
constexpr std::uint64_t max_all_delay_steps = 10'000'000;

class CallTyping {
 public:
  CallTyping(OperandTypes& operands, std::int64_t period_ns) : operands_(operands), period_ns_(period_ns) {}

  Type call_type(std::size_t i, std::vector<std::string> names) {
    const config::Expression::Node& node = operands_.node(i);
    const Function* function = function_named(node.word.text);
    if (function == nullptr) {
      for (const Function& known : functions())
        names.emplace_back(known.name);
      for (const RelationFunction& known : relation_functions())
        names.emplace_back(known.name);
      return operands_.fail(
          i, "there is no function " + in_quotes(node.word.text) + config::suggestion(node.word.text, names));
    }
    if (function->state_size > 0 && period_ns_ <= 0)
      return operands_.fail(
          i, in_quotes(node.word.text) + " needs steps of one period, which there are not here");
    const Type type = function->signature == "pid" ? pid_type(i, *function) : signature_type(i, *function);
    if (type.kind == Type::Kind::invalid) return type;
    return check_constants(i, *function) ? type : Type{};
  }

 private:
  Type wrong_count(std::size_t i, const Function& function) {
    return operands_.fail(i, in_quotes(function.name) + " has " +
                                 std::to_string(operands_.node(i).parts.size()) +
                                 (operands_.node(i).parts.size() == 1 ? " argument" : " arguments") +
                                 ", but takes (" + std::string(function.arguments) + ")");
  }

  /// False with a mistake: no step could have a result.
  bool check_constants(std::size_t i, const Function& function) {
    std::vector<double> constants;
    for (const std::uint32_t part : operands_.node(i).parts)
      constants.push_back(operands_[part].constant.value_or(std::numeric_limits<double>::quiet_NaN()));
    if (function.problem != nullptr) {
      if (const std::string_view problem = function.problem(constants); !problem.empty()) {
        operands_.fail(i, in_quotes(function.name) + ": " + std::string(problem));
        return false;
      }
      std::vector<double> with_names = constants;
      for (std::size_t k = 0; k < constants.size(); ++k)
        if (const auto value = operands_.named_constant(operands_.node(i).parts[k])) with_names[k] = *value;
      if (const std::string_view problem = function.problem(with_names); !problem.empty())
        operands_.warn(i, in_quotes(function.name) + ": " + std::string(problem) +
                              ", with the variables of the scenario");
    }
    const bool has_result = function.state_size > 0 || function.reports_known ||
                            std::ranges::any_of(constants, [](double value) { return std::isnan(value); });
    if (has_result) return true;
    bool is_lower_bound = false;
    const double result = function.value(
        {.arguments = constants, .state = {}, .constants = {}, .is_lower_bound = is_lower_bound});
    if (std::isfinite(result)) return true;
    operands_.fail(i, in_quotes(function.name) + " has no value for these arguments");
    return false;
  }

  Type signature_type(std::size_t i, const Function& function) {
    const std::vector<std::uint32_t>& parts = operands_.node(i).parts;
    const std::size_t colon = function.signature.find(':');
    std::vector<char> kinds;
    std::size_t needed = 0;
    bool repeats = false, optional = false;
    for (const char c : function.signature.substr(0, colon)) {
      if (c == '[') optional = true;
      if (c == '+') repeats = true;
      if (c == '[' || c == ']' || c == '+') continue;
      kinds.push_back(c);
      needed += optional ? 0 : 1;
    }
    if (parts.size() < needed || (!repeats && parts.size() > kinds.size())) return wrong_count(i, function);
    const auto kind_of = [&](std::size_t k) { return k < kinds.size() ? kinds[k] : kinds.back(); };
    // All q are alike: the first one that is not bare gives its unit to those that are. A number in degrees
    // is a temperature or a difference as the others are.
    const auto rank = [&](std::uint32_t part) {
      const Type& type = operands_[part];
      return type.kind == Type::Kind::bare ? 0 : type.temperature == Temperature::degrees ? 1 : 2;
    };
    std::optional<std::uint32_t> like;
    for (std::size_t k = 0; k < parts.size(); ++k)
      if (kind_of(k) == 'q' && (!like || rank(*like) < rank(parts[k]))) like = parts[k];
    if (function.takes_difference && !operands_.take_difference(*like, in_quotes(function.name))) return {};
    Type common = like ? operands_[*like] : Type{.kind = Type::Kind::bare};
    for (std::size_t k = 0; k < parts.size(); ++k)
      if (!check_argument(i, parts[k], kind_of(k), like, common)) return {};
    if (function.needs_absolute_zero && common.is_point())
      return operands_.fail(i, in_quotes(function.name) + " of a temperature" +
                                   (common.unit ? " in " + common.unit->symbol : std::string()) +
                                   " depends on where its scale begins; write K, or take a difference");
    return result_type(i, function.signature[colon + 1], common, parts);
  }

  /// `common`: the type of all q so far, or of the only r or p.
  bool check_argument(std::size_t i, std::uint32_t part, char kind, std::optional<std::uint32_t> like,
                      Type& common) {
    switch (kind) {
      case 't':
        return operands_.need_truth(part, in_quotes(operands_.name_of(i)));
      case '1':
        if (operands_[part].is_plain()) return operands_.need_number(i, part);
        if (!operands_.need_number(i, part)) return false;
        operands_.fail(part, in_quotes(operands_.name_of(i)) + " needs a plain number; this is in " +
                                 unit_text(operands_[part]));
        return false;
      case 'n':
        return check_number(i, part);
      case 's':
      case 'S':
        return check_duration(i, part, kind == 'S');
      case 'v':
        return check_rate(i, part, common);
      case 'q': {
        if (part == *like) return operands_.need_number(i, part);
        const auto both = operands_.common_type(i, *like, part, BareNumber::is_value);
        if (!both) return false;
        if (!both->unit) common.unit.reset();
        common.temperature = both->temperature;
        common.angle = both->angle;
        return true;
      }
      default:  // r, p
        if (!operands_.need_number(i, part)) return false;
        common = operands_[part];
        return true;
    }
  }

  /// A share or an angle is no number by itself: the number of 5 % is 5 or 0.05.
  bool check_number(std::size_t i, std::uint32_t part) {
    if (!operands_.need_number(i, part)) return false;
    const Type& type = operands_[part];
    const bool has_unit = type.kind == Type::Kind::opaque || !type.is_plain() || type.angle.exponent != 0 ||
                          (type.unit && !units::is_si(*type.unit));
    if (!has_unit) return true;
    const bool is_angle = type.is_plain() && (!type.unit || type.unit->symbol == "1");
    const std::string unit = !is_angle ? unit_text(type) : type.angle.in_turns ? "rev" : "rad";
    operands_.fail(part, in_quotes(operands_.name_of(i)) + " needs a plain number; this is in " + unit +
                             (type.is_point() ? std::string() : "; divide it by 1 " + unit));
    return false;
  }

  bool check_duration(std::size_t i, std::uint32_t part, bool is_constant) {
    const Dimension time{{0, 0, 1}};
    if (!operands_.need_number(i, part)) return false;
    const Type& type = operands_[part];
    if (type.kind != Type::Kind::quantity || type.dimension != time || type.angle.in_turns) {
      operands_.fail(part, in_quotes(operands_.name_of(i)) + " needs a duration, as '20 ms'");
      return false;
    }
    if (!is_constant) return true;
    if (!type.constant) {
      operands_.fail(part, in_quotes(operands_.name_of(i)) + " needs a constant duration, as '20 ms'");
      return false;
    }
    const double steps = *type.constant / period_s();
    if (*type.constant < 0.0 || steps > max_delay_steps) {
      operands_.fail(part, "a delay of " + config::format_number(*type.constant, 6) + " s is " +
                               config::format_number(steps, 6) + " steps of " +
                               config::format_number(period_s(), 6) + " s; 0 to " +
                               config::format_number(max_delay_steps) + " are possible");
      return false;
    }
    if (std::abs(steps - std::round(steps)) > 1e-6 * std::max(1.0, steps)) {
      operands_.fail(part, "a delay of " + config::format_number(*type.constant, 6) + " s is " +
                               config::format_number(steps, 6) + " steps of " +
                               config::format_number(period_s(), 6) + " s; use a whole number of steps");
      return false;
    }
    const std::uint64_t all = operands_.add_delay(part, static_cast<std::uint64_t>(std::round(steps)));
    if (all <= max_all_delay_steps) return true;
    operands_.fail(part, "up to here all delays together have " + std::to_string(all) + " steps; " +
                             std::to_string(max_all_delay_steps) + " are possible");
    return false;
  }

  /// A change of `common` per second; a bare number takes the unit of `common` per second.
  bool check_rate(std::size_t i, std::uint32_t part, const Type& common) {
    if (!operands_.need_number(i, part)) return false;
    const Type& type = operands_[part];
    if (common.kind != Type::Kind::quantity) {
      if (type.is_plain()) return true;
    } else {
      const auto required = units::product(common.dimension, {{0, 0, -1}});
      const units::Angle angle{common.angle.exponent, common.angle.in_turns, true};
      if (type.kind == Type::Kind::quantity && required && type.dimension == *required &&
          operands_.take_angle(part, angle))
        return true;
      if (type.kind == Type::Kind::bare && common.unit && common.unit->offset == 0.0 && required) {
        Unit unit = *common.unit;
        unit.symbol += unit.symbol.empty() ? "1/s" : "/s";
        unit.dimension = *required;
        operands_.take_unit(part, unit);
        return true;
      }
    }
    operands_.fail(
        part, in_quotes(operands_.name_of(i)) + " needs a change of " + unit_text(common) + " per second");
    return false;
  }

  Type result_type(std::size_t i, char kind, const Type& common, const std::vector<std::uint32_t>& parts) {
    Type type = common;
    type.constant.reset();
    const auto times = [&](int seconds) -> Type {
      const auto dimension = units::product(common.dimension, {{0, 0, static_cast<std::int8_t>(seconds)}});
      if (!dimension) return operands_.fail(i, "the unit of the result has an exponent beyond 100");
      if (common.kind == Type::Kind::opaque)
        return operands_.fail(i,
                              in_quotes(common.opaque_unit) + " is not a known unit, so the result has none");
      Type result = quantity(*dimension);
      result.angle = {common.angle.exponent, common.angle.in_turns, !common.angle.is_cycles};
      const bool is_frequency = units::is_rate(common.dimension) && !common.angle.is_open;
      result.angle.is_cycles = dimension->is_one() && common.angle.exponent == 0 && is_frequency;
      if (common.kind == Type::Kind::bare || (common.unit && units::is_si(*common.unit)))
        result.unit = natural_unit(result);
      return result;
    };
    switch (kind) {
      case 't':
        return truth();
      case '1':
        return quantity(si_unit({}));
      case 's':
        return quantity(si_unit({{0, 0, 1}}));
      case 'R': {
        if (common.kind == Type::Kind::opaque)
          return operands_.fail(i,
                                in_quotes(common.opaque_unit) + " is not a known unit, so the root has none");
        const auto dimension = units::square_root(common.dimension);
        if (!dimension)
          return operands_.fail(
              parts[0], "a value in " + unit_text(common) + " has no square root, since its unit has none");
        if (common.kind == Type::Kind::bare) return type;
        if (common.angle.in_turns && common.angle.exponent % 2 != 0 && !dimension->is_one())
          return operands_.fail(parts[0], "a value in " + unit_text(common) +
                                              " counts turns, of which there is no square root");
        Type result = quantity(*dimension);
        if (common.angle.exponent % 2 == 0)
          result.angle = {static_cast<std::int8_t>(common.angle.exponent / 2), common.angle.in_turns, true};
        if (result.angle.exponent == 0) result.angle.in_turns = false;
        if (dimension->is_one() || (common.unit && units::is_si(*common.unit)))
          result.unit = natural_unit(result);
        return result;
      }
      case 'v':
        return times(-1);
      case 'P':
        return times(1);
      default:
        return type;
    }
  }

  /// kp error + ki times the error's integral + kd times its derivative, in the unit of low and high. Bare
  /// gains are in the SI.
  Type pid_type(std::size_t i, const Function& function) {
    const std::vector<std::uint32_t>& parts = operands_.node(i).parts;
    if (parts.size() != 6) return wrong_count(i, function);
    for (const std::uint32_t part : parts)
      if (!operands_.need_number(i, part)) return {};
    for (const std::uint32_t part : parts)
      if (operands_[part].kind == Type::Kind::opaque)
        return operands_.fail(part, in_quotes(operands_[part].opaque_unit) + " is not a known unit");
    const auto limits = operands_.common_type(i, parts[4], parts[5], BareNumber::is_value);
    if (!limits) return {};
    if (limits->is_point())
      return operands_.fail(parts[4], "the output of 'pid' is a difference, so its limits can not be in " +
                                          (limits->unit ? limits->unit->symbol : "degC or degF") +
                                          "; write them in K");
    const Dimension output = limits->dimension, error = operands_[parts[0]].dimension;
    const auto inverse = units::power(error, -1);
    for (int k = 1; k <= 3; ++k) {
      const auto seconds = static_cast<std::int8_t>(k == 2 ? -1 : k == 3 ? 1 : 0);
      const auto per_error = inverse ? units::product(output, *inverse) : std::nullopt;
      const auto required = per_error ? units::product(*per_error, {{0, 0, seconds}}) : std::nullopt;
      const Type& gain = operands_[parts[static_cast<std::size_t>(k)]];
      if (gain.kind == Type::Kind::bare) continue;
      const units::Angle& of_error = operands_[parts[0]].angle;
      const int exponent = limits->angle.exponent - of_error.exponent;
      const units::Angle angle{static_cast<std::int8_t>(std::clamp(exponent, -100, 100)),
                               exponent != 0 && (limits->angle.in_turns || of_error.in_turns), true};
      if (required && gain.dimension == *required &&
          !operands_.take_angle(parts[static_cast<std::size_t>(k)], angle))
        return operands_.fail(parts[static_cast<std::size_t>(k)],
                              std::string("this gain is ") + in_unit_text(gain) +
                                  units::angle_hint(*required, gain.angle, angle));
      if (!required || gain.dimension != *required)
        return operands_.fail(
            parts[static_cast<std::size_t>(k)],
            std::string("this gain is ") + in_unit_text(gain) + ", but needs " +
                (required ? units::si_symbol(*required) : "a unit with an exponent beyond 100"));
    }
    return *limits;
  }

  double period_s() const { return static_cast<double>(period_ns_) / 1e9; }

  OperandTypes& operands_;
  const std::int64_t period_ns_;
};

}  // namespace

const Function* function_named(std::string_view name) {
  const auto found = std::ranges::find(functions(), name, &Function::name);
  return found == functions().end() ? nullptr : &*found;
}

Type call_type(OperandTypes& operands, std::size_t node, std::vector<std::string> other_names,
               std::int64_t period_ns) {
  return CallTyping(operands, period_ns).call_type(node, std::move(other_names));
}

Type table_call_type(OperandTypes& operands, std::size_t node, const Table& table) {
  const config::Expression::Node& call = operands.node(node);
  const std::size_t arguments = call.parts.size();
  if (arguments != table.axes().size()) {
    return operands.fail(node, "the table " + in_quotes(call.word.text) + " takes " +
                                   (table.axes().size() == 1 ? "one argument" : "two arguments") + ", not " +
                                   std::to_string(arguments));
  }
  for (std::size_t k = 0; k < arguments; ++k) {
    const std::uint32_t part = call.parts[k];
    const Unit& unit = table.axes()[k].unit;
    if (!operands.need_number(node, part)) return {};
    const Type& type = operands[part];
    if (type.kind == Type::Kind::bare) {
      operands.take_unit(part, unit);
    } else if (type.kind != Type::Kind::quantity || type.dimension != unit.dimension ||
               (unit.offset != 0.0 && type.temperature == Temperature::difference) ||
               !operands.take_angle(part, unit.angle)) {
      return operands.fail(part, "the table " + in_quotes(call.word.text) + " takes " +
                                     described(quantity(unit)) + "; this is " + in_unit_text(type));
    }
  }
  return quantity(table.unit());
}

}  // namespace hil::expression
