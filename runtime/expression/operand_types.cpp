#include "runtime/expression/operand_types.hpp"

namespace hil::expression {
namespace {

using config::Expression;
using config::in_quotes;
using units::Dimension;
using units::Unit;
using Operation = Expression::Operation;

bool is_same(const Unit& a, const Unit& b) {
  return a.numerator == b.numerator && a.denominator == b.denominator && a.offset == b.offset;
}

}  // namespace

Type quantity(const Unit& unit) {
  return {.kind = Type::Kind::quantity, .dimension = unit.dimension, .unit = unit};
}
Type quantity(const Dimension& dimension) {
  return {.kind = Type::Kind::quantity, .dimension = dimension};
}
Type truth() {
  return {.kind = Type::Kind::truth};
}

Unit si_unit(const Dimension& dimension) {
  return {.symbol = units::si_symbol(dimension), .dimension = dimension};
}
bool is_si(const Unit& unit) {
  return unit.numerator == unit.denominator && unit.offset == 0.0;
}
std::string unit_text(const Type& type) {
  if (type.kind == Type::Kind::opaque) return type.opaque_unit;
  if (type.unit && !type.unit->symbol.empty()) return type.unit->symbol;
  return type.dimension.is_one() ? "a plain number" : units::si_symbol(type.dimension);
}

Type OperandTypes::fail(std::size_t node, const std::string& message) {
  diagnostics_.add(nodes_[node].word.place, message);
  return {};
}

std::optional<Type> OperandTypes::joined(std::size_t at, std::uint32_t first, std::uint32_t second,
                                         Offset offset) {
  const Type& a = types_[first];
  const Type& b = types_[second];
  for (const std::uint32_t part : {first, second}) {
    if (types_[part].is_number()) continue;
    fail(part,
         "this is true or false, and " + in_quotes(name_of(at)) + " needs numbers; use if ... then 1 else 0");
    return std::nullopt;
  }
  if (a.kind == Type::Kind::bare && b.kind == Type::Kind::bare) return Type{.kind = Type::Kind::bare};
  if (a.kind == Type::Kind::bare) return adopted(at, first, second, offset);
  if (b.kind == Type::Kind::bare) return adopted(at, second, first, offset);
  if (a.kind == Type::Kind::opaque || b.kind == Type::Kind::opaque) {
    if (a.kind == b.kind && a.opaque_unit == b.opaque_unit) return Type{a};
    const Type& opaque = a.kind == Type::Kind::opaque ? a : b;
    fail(at, in_quotes(name_of(at)) + " has operands in " + unit_text(a) + " and " + unit_text(b) + ", and " +
                 in_quotes(opaque.opaque_unit) + " is not a known unit");
    return std::nullopt;
  }
  if (a.dimension != b.dimension) {
    fail(at, in_quotes(name_of(at)) + " has operands in " + unit_text(a) + " and " + unit_text(b));
    return std::nullopt;
  }
  const auto has_offset = [](const Type& part) { return part.unit && part.unit->offset != 0.0; };
  if ((a.is_difference && has_offset(b)) || (b.is_difference && has_offset(a))) {
    fail(at, in_quotes(name_of(at)) + " has a difference of temperatures and a temperature in " +
                 unit_text(a.is_difference ? b : a) + "; a difference is in K");
    return std::nullopt;
  }
  Type type = quantity(a.dimension);
  type.is_difference = a.is_difference && b.is_difference;
  if (a.unit && b.unit && is_same(*a.unit, *b.unit)) type.unit = a.unit;
  return type;
}

/// The bare number takes the unit of `other`.
std::optional<Type> OperandTypes::adopted(std::size_t at, std::uint32_t bare, std::uint32_t other,
                                          Offset offset) {
  Type type = types_[other];
  type.constant.reset();
  if (type.kind == Type::Kind::opaque) return type;
  if (!type.unit) {
    fail(bare, "this number needs a unit: the other side of " + in_quotes(name_of(at)) + " is in " +
                   units::si_symbol(type.dimension) + ", computed from several units");
    return std::nullopt;
  }
  if (type.unit->offset != 0.0 && offset == Offset::of_changes) {
    fail(bare, "this number needs a unit: with " + type.unit->symbol +
                   " it may be a temperature or a difference (K)");
    return std::nullopt;
  }
  take_unit(bare, *type.unit);
  return type;
}

void OperandTypes::take_unit(std::uint32_t bare, const Unit& unit) {
  conversions_[bare] = {unit.numerator, unit.denominator, unit.offset};
  if (types_[bare].constant) types_[bare].constant = unit.to_si(*types_[bare].constant);
  types_[bare].kind = Type::Kind::quantity;
  types_[bare].dimension = unit.dimension;
  types_[bare].unit = unit;
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
  fail(part, reader + " needs a condition; this is a value in " +
                 (types_[part].kind == Type::Kind::bare ? "a plain number" : unit_text(types_[part])));
  return false;
}

}  // namespace hil::expression
