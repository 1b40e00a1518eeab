#include "runtime/expression/operand_types.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <hil/numbers.hpp>

namespace hil::expression {
namespace {

using config::Expression;
using config::in_quotes;
using units::Dimension;
using units::Unit;
using Operation = Expression::Operation;

constexpr Dimension kelvins{{0, 0, 0, 0, 1}};
constexpr const char* plain_number = "a plain number";

/// "operands in m and s", "as operands a value in m and a plain number"
std::string operands_text(const Type& a, const Type& b) {
  const bool have_units = described(a) != plain_number && described(b) != plain_number;
  return have_units ? "operands in " + unit_text(a) + " and " + unit_text(b)
                    : "as operands " + described(a) + " and " + described(b);
}

/// "rev2": the angle with a positive exponent.
std::string angle_symbol(const units::Angle& angle) {
  const int exponent = std::abs(angle.exponent);
  return (angle.in_turns ? "rev" : "rad") + (exponent == 1 ? std::string() : std::to_string(exponent));
}

}  // namespace

Type quantity(const Unit& unit) {
  Type type{.kind = Type::Kind::quantity, .dimension = unit.dimension, .unit = unit, .angle = unit.angle};
  if (unit.dimension == kelvins)
    type.temperature = unit.offset != 0.0 ? Temperature::point : Temperature::kelvin;
  return type;
}
Type quantity(const Dimension& dimension) {
  return {.kind = Type::Kind::quantity,
          .dimension = dimension,
          .temperature = dimension == kelvins ? Temperature::open : Temperature::none,
          .angle = {.is_open = true}};
}
Type truth() {
  return {.kind = Type::Kind::truth};
}

Unit si_unit(const Dimension& dimension) {
  return {.symbol = units::si_symbol(dimension), .dimension = dimension};
}
Unit natural_unit(const Type& type) {
  const Unit plain = si_unit(type.dimension);
  const bool has_angle =
      type.dimension.is_one()
          ? type.angle.exponent == 1 && type.angle.in_turns
          : type.angle.exponent != 0 && (type.angle.in_turns || units::is_rate(type.dimension));
  if (!has_angle) return plain;
  if (type.dimension.is_one()) return *units::parse_unit("rev");
  const std::string angle = angle_symbol(type.angle);
  std::string symbol = plain.symbol;
  if (type.angle.exponent < 0)
    symbol += (symbol.find('/') == std::string::npos ? "/" : " ") + angle;
  else
    symbol = symbol.starts_with("1/") ? angle + symbol.substr(1) : angle + " " + symbol;
  const auto unit = units::parse_unit(symbol);
  return unit ? *unit : plain;
}
std::string unit_text(const Type& type) {
  if (type.kind == Type::Kind::opaque) return type.opaque_unit;
  if (type.unit && !type.unit->symbol.empty() && type.unit->symbol != "1") return type.unit->symbol;
  return type.dimension.is_one() ? plain_number : natural_unit(type).symbol;
}
std::string in_unit_text(const Type& type) {
  return in_unit_text(unit_text(type));
}
std::string in_unit_text(const std::string& unit) {
  return unit.empty() || unit == plain_number ? plain_number : "in " + unit;
}
std::string described(const Type& type) {
  const std::string text = in_unit_text(type);
  return text == plain_number ? text : "a value " + text;
}

Type OperandTypes::fail(std::size_t node, const std::string& message) {
  diagnostics_.add(nodes_[node].word.place, message);
  return {};
}

void OperandTypes::warn(std::size_t node, const std::string& message) {
  diagnostics_.warn(nodes_[node].word.place, message);
}

std::optional<Type> OperandTypes::common_type(std::size_t at, std::uint32_t first, std::uint32_t second,
                                              BareNumber bare_number) {
  const Type& a = types_[first];
  const Type& b = types_[second];
  for (const std::uint32_t part : {first, second}) {
    if (types_[part].is_number()) continue;
    fail(part,
         "this is true or false, and " + in_quotes(name_of(at)) + " needs numbers; use if ... then 1 else 0");
    return std::nullopt;
  }
  if (a.kind == Type::Kind::bare && b.kind == Type::Kind::bare) return Type{.kind = Type::Kind::bare};
  if (a.kind == Type::Kind::bare) return type_of_number_beside(at, first, second, bare_number);
  if (b.kind == Type::Kind::bare) return type_of_number_beside(at, second, first, bare_number);
  if (a.kind == Type::Kind::opaque || b.kind == Type::Kind::opaque) {
    if (a.kind == b.kind && a.opaque_unit == b.opaque_unit) return Type{a};
    const Type& opaque = a.kind == Type::Kind::opaque ? a : b;
    fail(at, in_quotes(name_of(at)) + " has " + operands_text(a, b) + ", and " +
                 in_quotes(opaque.opaque_unit) + " is not a known unit");
    return std::nullopt;
  }
  if (a.dimension != b.dimension) {
    fail(at, in_quotes(name_of(at)) + " has " + operands_text(a, b));
    return std::nullopt;
  }
  warn_of_missing_unit(first, b);
  warn_of_missing_unit(second, a);
  Type type = quantity(a.dimension);
  if (a.unit && b.unit && units::is_same(*a.unit, *b.unit)) type.unit = a.unit;
  const auto temperature = common_temperature(at, first, second);
  const auto angle = convert_to_common_angle(at, first, second);
  if (!temperature || !angle) return std::nullopt;
  type.temperature = types_[first].temperature = *temperature;  // further arguments of a function are alike
  type.angle = types_[first].angle = *angle;
  return type;
}

/// The temperatures of a comparison, or of values of one kind.
std::optional<Temperature> OperandTypes::common_temperature(std::size_t at, std::uint32_t first,
                                                            std::uint32_t second) {
  using enum Temperature;
  const Temperature a = types_[first].temperature, b = types_[second].temperature;
  const auto one_is = [&](Temperature temperature) { return a == temperature || b == temperature; };
  const std::uint32_t other = a == degrees ? second : first;  // beside degrees
  if (a == b) return a;
  if (one_is(degrees) && one_is(difference)) {
    settle_as_difference(a == degrees ? first : second);
    return difference;
  }
  if (one_is(degrees) && one_is(open)) {
    fail(at, in_quotes(name_of(at)) + " has a number in " + unit_text(types_[a == degrees ? first : second]) +
                 " beside a computed value in " + unit_text(types_[other]) +
                 ", which may be a temperature or a difference; write the number in K");
    return std::nullopt;
  }
  if (one_is(point) && one_is(difference)) {
    fail(at, in_quotes(name_of(at)) + " has a difference of temperatures and a temperature in " +
                 unit_text(types_[a == point ? first : second]) + "; a difference is in K");
    return std::nullopt;
  }
  for (const Temperature result : {point, degrees, difference, open})
    if (one_is(result)) return result == degrees ? point : result;
  return a;
}

std::optional<Type> OperandTypes::type_of_sum(std::size_t at, std::uint32_t first, std::uint32_t second,
                                              bool is_sum) {
  const auto is_temperature = [&](std::uint32_t part) {
    return types_[part].kind == Type::Kind::quantity && types_[part].temperature != Temperature::none;
  };
  if (!is_temperature(first) || !is_temperature(second))
    return common_type(at, first, second, BareNumber::may_be_difference);
  Type type = quantity(kelvins);
  const auto &a = types_[first].unit, &b = types_[second].unit;
  if (a && b && a->offset == 0.0 && units::is_same(*a, *b)) type.unit = a;
  const auto temperature =
      is_sum ? temperature_of_sum(at, first, second) : temperature_of_difference(at, first, second);
  if (!temperature) return std::nullopt;
  type.temperature = *temperature;
  return type;
}

std::optional<Temperature> OperandTypes::temperature_of_sum(std::size_t at, std::uint32_t first,
                                                            std::uint32_t second) {
  using enum Temperature;
  const Temperature a = types_[first].temperature, b = types_[second].temperature;
  if (types_[first].is_point() && types_[second].is_point()) {
    if (a == point && b == point) {
      fail(at, "temperatures in degC or degF can not be added; write the one that is a difference in K");
      return std::nullopt;
    }
    settle_as_difference(b == degrees ? second : first);
    return point;
  }
  if (types_[first].is_point() || types_[second].is_point()) return point;
  const auto is_kelvin_number = [&](std::uint32_t part) {
    return types_[part].temperature == kelvin && nodes_[part].operation == Operation::number;
  };
  if (a == difference && (b == difference || is_kelvin_number(second))) return difference;
  if (b == difference && is_kelvin_number(first)) return difference;
  return a == kelvin && b == kelvin ? kelvin : open;
}

std::optional<Temperature> OperandTypes::temperature_of_difference(std::size_t at, std::uint32_t first,
                                                                   std::uint32_t second) {
  using enum Temperature;
  const Temperature a = types_[first].temperature, b = types_[second].temperature;
  if (types_[second].is_point()) {
    if (a != difference) return difference;
    fail(
        at,
        "a temperature in " + unit_text(types_[second]) +
            " can not be subtracted from a difference of temperatures; write the subtracted difference in K");
    return std::nullopt;
  }
  if (types_[first].is_point()) return point;
  if (a == difference) return difference;
  return b == kelvin && nodes_[second].operation == Operation::number ? a : open;
}

bool OperandTypes::take_difference(std::uint32_t part, const std::string& reader) {
  const Type& type = types_[part];
  if (type.temperature == Temperature::point) {
    fail(part, reader + " needs a difference of temperatures; this is a temperature" +
                   (type.unit ? " in " + type.unit->symbol : std::string()) + "; a difference is in K");
    return false;
  }
  if (type.temperature == Temperature::degrees) settle_as_difference(part);
  return true;
}

/// Makes a number in degrees a difference, and the numbers in its parts: the operand of a sign, the branches
/// of `if`, the arguments of a function.
void OperandTypes::settle_as_difference(std::uint32_t part) {
  Type& type = types_[part];
  if (type.temperature != Temperature::degrees) return;
  type.temperature = Temperature::difference;
  if (type.constant && type.unit) *type.constant -= type.unit->offset;
  type.unit.reset();
  conversions_[part].offset = 0.0;
  for (const std::uint32_t inner : nodes_[part].parts)
    settle_as_difference(inner);
}

/// Converts one of both where one counts turns and the other one cycles.
std::optional<units::Angle> OperandTypes::convert_to_common_angle(std::size_t at, std::uint32_t first,
                                                                  std::uint32_t second) {
  const units::Angle a = types_[first].angle, b = types_[second].angle;
  const Dimension& dimension = types_[first].dimension;
  const auto exponent = units::two_pi_exponent_between(dimension, b, a);
  if (!exponent) {
    fail(at, in_quotes(name_of(at)) + " has " + operands_text(types_[first], types_[second]) +
                 units::angle_hint(dimension, b, a));
    return std::nullopt;
  }
  if (*exponent != 0) {
    const bool converts_first = a.in_turns && nodes_[at].operation != Operation::call;
    take_angle(converts_first ? first : second, converts_first ? b : a);
    return types_[converts_first ? second : first].angle;
  }
  const bool is_settled = a.exponent == b.exponent || units::is_rate(dimension);
  if (!is_settled) return units::Angle{.is_open = true};
  units::Angle angle = a.exponent == 0 && a.is_open ? b : a;
  angle.is_cycles = a.is_cycles || b.is_cycles;
  return angle;
}

bool OperandTypes::take_angle(std::uint32_t part, const units::Angle& angle) {
  Type& type = types_[part];
  const auto exponent = units::two_pi_exponent_between(type.dimension, type.angle, angle);
  if (!exponent) return false;
  if (*exponent == 0) return true;
  const Operation operation = nodes_[part].operation;
  const bool is_read = operation == Operation::number || operation == Operation::name;
  const Unit from = is_read && type.unit
                        ? *type.unit
                        : Unit{.symbol = {}, .dimension = type.dimension, .angle = type.angle};
  const units::Conversion change =
      *units::conversion(from, {.symbol = {}, .dimension = type.dimension, .angle = angle});
  if (is_read && type.unit) {
    conversions_[part] = change;
  } else {
    conversions_[part].numerator *= change.numerator;
    conversions_[part].denominator *= change.denominator;
  }
  if (type.constant) *type.constant *= std::pow(2.0 * std::numbers::pi, *exponent);
  type.unit.reset();
  type.angle = angle;
  return true;
}

void OperandTypes::warn_of_missing_unit(std::uint32_t part, const Type& other) {
  if (!types_[part].lacks_unit || !other.unit || units::is_si(*other.unit)) return;
  while (nodes_[part].operation != Operation::name && !nodes_[part].parts.empty())
    part = nodes_[part].parts.front();  // abs(x) is what x is
  diagnostics_.warn(nodes_[part].word.place, units::missing_unit_text(nodes_[part].word.text, *other.unit));
}

/// The bare number takes the unit of `other`.
std::optional<Type> OperandTypes::type_of_number_beside(std::size_t at, std::uint32_t bare,
                                                        std::uint32_t other, BareNumber bare_number) {
  Type type = types_[other];
  type.constant.reset();
  if (type.kind == Type::Kind::opaque) return type;
  if (!type.unit) {
    const std::string other_side = "this number needs a unit: the other side of " + in_quotes(name_of(at));
    fail(bare,
         other_side + (type.dimension.is_one()
                           ? " is a share or an angle, computed from several units; write it in %, "
                             "deg, rad or rev"
                           : " is in " + units::si_symbol(type.dimension) + ", computed from several units"));
    return std::nullopt;
  }
  if (type.unit->offset != 0.0 && bare_number == BareNumber::may_be_difference) {
    fail(bare, "this number needs a unit: with " + type.unit->symbol +
                   " it may be a temperature or a difference (K)");
    return std::nullopt;
  }
  take_unit(bare, *type.unit);
  return type;
}

void OperandTypes::take_unit(std::uint32_t bare, const Unit& unit) {
  const auto constant = types_[bare].constant;
  conversions_[bare] = unit.to_si();
  types_[bare] = quantity(unit);
  if (unit.offset != 0.0) types_[bare].temperature = Temperature::degrees;
  if (constant) types_[bare].constant = unit.to_si(*constant);
}

std::string OperandTypes::name_of(std::size_t node) const {
  return nodes_[node].operation == Operation::call ? nodes_[node].word.text
                                                   : config::to_string(nodes_[node].operation);
}

bool OperandTypes::need_number(std::size_t at, std::uint32_t part) {
  if (types_[part].is_number()) return true;
  fail(part,
       "this is true or false, and " + in_quotes(name_of(at)) + " needs numbers; use if ... then 1 else 0");
  return false;
}

bool OperandTypes::need_truth(std::uint32_t part, const std::string& reader) {
  if (types_[part].kind == Type::Kind::truth) return true;
  if (types_[part].is_plain() && nodes_[part].operation != Operation::number) {
    is_tested_.insert(part);
    return true;
  }
  fail(part, reader + " needs a condition; this is " + described(types_[part]));
  return false;
}

}  // namespace hil::expression
