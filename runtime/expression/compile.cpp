#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <hil/numbers.hpp>

#include "runtime/expression/call_type.hpp"
#include "runtime/expression/operand_types.hpp"
#include "runtime/expression/program.hpp"
#include "runtime/expression/relation.hpp"

namespace hil::expression {
namespace {

using config::Diagnostics;
using config::Expression;
using config::in_quotes;
using Operation = Expression::Operation;
using units::Unit;

}  // namespace

/// Finds the types of all parts, then writes the instructions.
class Compiler {
 public:
  Compiler(const Expression& expression, const Scope& scope, const CompileOptions& options,
           Diagnostics& diagnostics)
      : text_(expression.text()),
        nodes_(expression.nodes()),
        types_(nodes_, diagnostics),
        scope_(scope),
        options_(options),
        diagnostics_(diagnostics),
        is_untyped_(relation_arguments(nodes_)),
        variables_(nodes_.size()),
        named_(nodes_.size()) {}

  std::optional<Program> compile(const ResultSpec& spec) {
    const std::size_t before = diagnostics_.count();
    for (const Node& node : nodes_) {
      if (!calls_unknown_function(node)) continue;
      for (const std::uint32_t part : node.parts)
        is_untyped_[part] = true;  // one mistake, of the call
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (!is_untyped_[i]) types_[i] = type_of(i);
    check_result(spec);
    if (diagnostics_.count() != before || types_[nodes_.size() - 1].kind == Type::Kind::invalid)
      return std::nullopt;
    write(nodes_.size() - 1);
    if (spec.truth && types_[nodes_.size() - 1].kind != Type::Kind::truth)
      add({.code = Program::Code::truth_of_number});
    program_.stack_.resize(max_depth_);
    program_.plain_stack_.resize(max_depth_);
    std::ranges::sort(program_.variables_);
    const auto same = std::ranges::unique(program_.variables_);
    program_.variables_.erase(same.begin(), same.end());
    if (!program_.variables_.empty()) program_.min_values_ = program_.variables_.back() + 1;
    return std::move(program_);
  }

 private:
  using Node = Expression::Node;
  using Code = Program::Code;

  // ---- types

  Type type_of(std::size_t i) {
    const Node& node = nodes_[i];
    if (is_relation(node)) return relation_type(i);
    if (calls_unknown_function(node)) return call_type(types_, i, scope_.table_names(), options_.period_ns);
    for (const std::uint32_t part : node.parts)
      if (types_[part].kind == Type::Kind::invalid && !is_value_name(i, part)) return {};
    switch (node.operation) {
      case Operation::number:
        return number_type(i);
      case Operation::truth: {
        Type type = truth();
        type.constant = node.number;
        return type;
      }
      case Operation::name:
        return name_type(i);
      case Operation::quoted:
        return quoted_type(i);
      case Operation::call:
        if (const Table* table = scope_.find_table(node.word.text)) return table_call_type(types_, i, *table);
        if (scope_.is_broken(node.word.text)) return {};
        return call_type(types_, i, scope_.table_names(), options_.period_ns);
      case Operation::conditional:
        return conditional_type(i);
      case Operation::any_of:
      case Operation::all_of:
      case Operation::negation:
        for (const std::uint32_t part : node.parts)
          if (!types_.need_truth(part, std::string("'") + config::to_string(node.operation) + "'")) return {};
        return truth();
      case Operation::equal:
      case Operation::not_equal:
      case Operation::less:
      case Operation::less_or_equal:
      case Operation::greater:
      case Operation::greater_or_equal:
        return comparison_type(i);
      case Operation::add:
      case Operation::subtract:
        return sum_type(i);
      case Operation::multiply:
      case Operation::divide:
        return product_type(i);
      case Operation::minus:
        return minus_type(i);
      case Operation::power:
        return power_type(i);
    }
    return {};
  }

  /// Whether the node calls what is neither a function nor a table nor a relation.
  bool calls_unknown_function(const Node& node) const {
    return node.operation == Operation::call && !is_relation(node) &&
           function_named(node.word.text) == nullptr && scope_.find_table(node.word.text) == nullptr &&
           !scope_.is_broken(node.word.text);
  }

  Type number_type(std::size_t i) {
    const Node& node = nodes_[i];
    if (!node.unit) return {.kind = Type::Kind::bare, .constant = node.number};
    types_.conversion(i) = node.unit->to_si();
    Type type = quantity(*node.unit);
    if (node.unit->offset != 0.0) type.temperature = Temperature::degrees;
    type.constant = node.unit->to_si(node.number);
    return type;
  }

  Type name_type(std::size_t i) {
    const config::Word& word = nodes_[i].word;
    if (word.text == "time") return quantity(si_unit({{0, 0, 1}}));
    variables_[i] = scope_.find(word.text);
    if (!variables_[i]) {
      // Beside a comparison it may be a value name; comparison_type() decides.
      if (!is_compared(i)) report_unknown(i);
      return {};
    }
    const std::string& symbol = variables_[i]->unit;
    const auto unit = units::parse_unit(symbol);
    if (!unit) return {.kind = Type::Kind::opaque, .opaque_unit = symbol};
    types_.conversion(i) = unit->to_si();
    if (variables_[i]->constant) types_.named_constant(i) = unit->to_si(*variables_[i]->constant);
    Type type = quantity(*unit);
    type.lacks_unit = variables_[i]->lacks_unit;
    if (variables_[i]->value_kind == units::ValueKind::as_unit) return type;
    type.angle = type.unit->angle = units::angle_of(*unit, units::ValueKind::open);
    if (type.temperature == Temperature::kelvin)
      type.temperature = variables_[i]->value_kind == units::ValueKind::difference ? Temperature::difference
                                                                                   : Temperature::open;
    return type;
  }

  Type relation_type(std::size_t i) {
    const auto relation = relation_of(nodes_, i, &diagnostics_);
    if (!relation) return {};
    const std::string name = relation_name(*relation);
    variables_[i] = scope_.find(name);
    if (!variables_[i])
      return types_.fail(i, in_quotes(name) +
                                " is known only to variables, stimuli, faults and expectations "
                                "of a scenario; give it to a variable there");
    return relation->function->unit.empty() ? truth()
                                            : quantity(*units::parse_unit(relation->function->unit));
  }

  void report_unknown(std::size_t i) {
    const config::Word& word = nodes_[i].word;
    if (function_named(word.text) != nullptr || relation_function(word.text) != nullptr) {
      diagnostics_.add(word.place,
                       "the function " + in_quotes(word.text) + " needs its arguments in parentheses");
      return;
    }
    if (scope_.is_broken(word.text)) return;
    const std::string unit = unit_in_parentheses(word.text);
    if (!unit.empty() && std::exchange(unit_in_parentheses_, unit) == unit)
      return;  // one mistake for all of it
    diagnostics_.add(word.place, "there is no " + scope_.noun() + " " + in_quotes(word.text) +
                                     (unit.empty() ? config::suggestion(word.text, scope_.names())
                                                   : "; a unit has no parentheses: write '" + unit +
                                                         "' with blanks around the sign"));
  }

  /// What divides or multiplies by the unit in parentheses that the symbol is in: "/ (1 km/h)" for
  /// `6 %/(km/h)`; "" where there is none.
  std::string unit_in_parentheses(const std::string& symbol) const {
    for (std::size_t begin = text_.find('('); begin != std::string::npos;
         begin = text_.find('(', begin + 1)) {
      const std::size_t sign = begin == 0 ? std::string::npos : text_.find_last_not_of(' ', begin - 1);
      if (sign == std::string::npos || (text_[sign] != '/' && text_[sign] != '*')) continue;
      const std::string inside = text_.substr(begin + 1, text_.find_first_of("()", begin + 1) - begin - 1);
      if (inside.find(symbol) != std::string::npos && units::parse_unit(symbol) && units::parse_unit(inside))
        return text_[sign] + (" (1 " + inside + ")");
    }
    return {};
  }

  Type quoted_type(std::size_t i) {
    if (is_compared(i)) return {};
    return types_.fail(i, "the value name " + in_quotes(nodes_[i].word.text) +
                              " is not compared with a value that has names");
  }

  /// Whether the node is an operand of a comparison.
  bool is_compared(std::size_t i) const {
    return std::ranges::any_of(nodes_, [&](const Node& node) {
      return is_comparison(node.operation) && std::ranges::find(node.parts, i) != node.parts.end();
    });
  }
  static bool is_comparison(Operation operation) {
    return operation >= Operation::equal && operation <= Operation::greater_or_equal;
  }
  bool is_value_name(std::size_t node, std::size_t part) const {
    const Operation operation = nodes_[part].operation;
    return is_comparison(nodes_[node].operation) &&
           (operation == Operation::quoted ||
            (operation == Operation::name && !variables_[part] && nodes_[part].word.text != "time"));
  }

  Type comparison_type(std::size_t i) {
    const std::uint32_t left = nodes_[i].parts[0], right = nodes_[i].parts[1];
    for (const auto& [name, signal] : {std::pair(left, right), std::pair(right, left)}) {
      if (!is_value_name(i, name)) continue;
      if (!set_named_value(name, signal)) return {};
    }
    const auto both = types_.common_type(i, left, right, BareNumber::is_value);
    if (!both) return {};
    for (const auto& [part, other] : {std::pair(left, right), std::pair(right, left)}) {
      if (types_[part].constant && !std::isfinite(*types_[part].constant))
        return types_.fail(part, "this constant has no value, so the comparison is unknown in every step");
      if (auto reason = constant_comparison(nodes_, i, part, types_[other].constant))
        return types_.fail(other, *reason);
    }
    return truth();
  }

  /// Makes a word or a text in quotes the value of that name of the signal on the other side.
  bool set_named_value(std::uint32_t name, std::uint32_t signal) {
    const config::Word& word = nodes_[name].word;
    const auto& variable = variables_[signal];
    if (!variable) {
      if (nodes_[name].operation == Operation::quoted)
        types_.fail(
            name, "the value name " + in_quotes(word.text) + " is not compared with a value that has names");
      else
        report_unknown(name);
      return false;
    }
    if (variable->accepts_any_name) {
      named_[name] = 0.0;
      types_[name] = {.kind = Type::Kind::bare};
      return true;
    }
    const auto* values = variable->named_values;
    const auto found = values == nullptr ? decltype(values->begin()){} : values->find(word.text);
    if (values != nullptr && found != values->end() && !std::isnan(found->second)) {
      named_[name] = found->second;
      types_[name] = {.kind = Type::Kind::bare, .constant = found->second};
      return true;
    }
    const std::string& of = nodes_[signal].word.text;
    if (values != nullptr && found != values->end()) {
      types_.fail(name, in_quotes(of) + " has several values with the name " + in_quotes(word.text) +
                            "; use the number");
      return false;
    }
    if (values == nullptr || values->empty()) {
      const std::vector<std::string> known = scope_.names();
      if (nodes_[name].operation == Operation::quoted)
        types_.fail(name, in_quotes(of) + " has no value names");
      else if (scope_.is_broken(word.text) || word.text.find('.') != std::string::npos ||
               !config::nearest(word.text, known).empty())
        report_unknown(name);
      else
        types_.fail(name, in_quotes(word.text) + " is no number and no " + scope_.noun() + ", and " +
                              in_quotes(of) + " has no value names");
      return false;
    }
    std::vector<std::string> names;
    for (const auto& [known, value] : *values)
      names.push_back(known);
    types_.fail(name, in_quotes(word.text) + " is no number and no " + scope_.noun() + ", and " +
                          in_quotes(of) + " has no value of that name" + config::all_known(word.text, names));
    return false;
  }

  Type sum_type(std::size_t i) {
    const std::uint32_t left = nodes_[i].parts[0], right = nodes_[i].parts[1];
    const bool is_sum = nodes_[i].operation == Operation::add;
    auto both = nodes_[i].is_margin ? types_.common_type(i, left, right, BareNumber::is_value)
                                    : types_.type_of_sum(i, left, right, is_sum);
    if (!both) return {};
    if (nodes_[i].is_margin && both->temperature != Temperature::none) {
      both->temperature = Temperature::difference;
      both->unit.reset();
    }
    both->constant = folded(left, right, [&](double a, double b) { return is_sum ? a + b : a - b; });
    return *both;
  }

  template <typename Function>
  std::optional<double> folded(std::uint32_t first, std::uint32_t second, Function function) const {
    if (!types_[first].constant || !types_[second].constant) return std::nullopt;
    return function(*types_[first].constant, *types_[second].constant);
  }

  Type product_type(std::size_t i) {
    const std::uint32_t left = nodes_[i].parts[0], right = nodes_[i].parts[1];
    const Type& a = types_[left];
    const Type& b = types_[right];
    if (!types_.need_number(i, left) || !types_.need_number(i, right)) return {};
    const bool divides = nodes_[i].operation == Operation::divide;
    const auto constant = folded(left, right, [&](double x, double y) { return divides ? x / y : x * y; });
    if (a.kind == Type::Kind::bare && b.kind == Type::Kind::bare)
      return {.kind = Type::Kind::bare, .constant = constant};
    if (a.kind == Type::Kind::opaque || b.kind == Type::Kind::opaque) {
      if (b.is_plain() || (a.is_plain() && !divides)) return a.kind == Type::Kind::opaque ? a : b;
      const Type& opaque = a.kind == Type::Kind::opaque ? a : b;
      return types_.fail(i, in_quotes(opaque.opaque_unit) + " is not a known unit, so " +
                                in_quotes(types_.name_of(i)) + " has no unit for its result");
    }
    const auto inverse = units::power(b.dimension, -1);
    const auto dimension = divides ? (inverse ? units::product(a.dimension, *inverse) : std::nullopt)
                                   : units::product(a.dimension, b.dimension);
    if (!dimension) return types_.fail(i, "the unit of this product has an exponent beyond 100");
    for (const auto& [temperature, factor] : {std::pair(left, right), std::pair(right, left)}) {
      const bool is_scaled = types_[factor].is_plain() && (temperature == left || !divides);
      if (!types_[temperature].is_point() || !is_scaled) continue;
      return types_.fail(i, "a temperature" + in_unit(types_[temperature]) +
                                " times or over a plain number depends on where its scale begins; write K");
    }
    Type type = quantity(*dimension);
    if (!set_angle(type, a, b, divides ? -1 : 1))
      return types_.fail(i, "the angle in the unit of this product has an exponent beyond 100");
    type.constant = constant;
    // A plain factor leaves what the other one is: twice a value in % is in %.
    if (is_factor(b, a) || (is_factor(a, b) && !divides)) {
      const Type& scaled = is_factor(b, a) ? a : b;
      type.temperature = scaled.temperature;
      const bool is_cycles = type.angle.is_cycles;
      type.angle = scaled.angle;
      type.angle.is_cycles = is_cycles;
      type.unit = scaled.unit;
      return type;
    }
    const auto is_in_si = [](const Type& part) {
      return part.kind == Type::Kind::bare || (part.unit && units::is_si(*part.unit));
    };
    // An arc is in the unit of its radius.
    for (const auto& [radius, angle] : {std::pair(&a, &b), std::pair(&b, &a)}) {
      const bool is_arc = angle->is_plain() && angle->angle.exponent != 0 && !angle->angle.in_turns &&
                          radius->angle.exponent == 0 && !radius->dimension.is_one() &&
                          !units::is_rate(radius->dimension) && (radius == &a || !divides);
      if (is_arc) type.unit = radius->unit;
    }
    // The product of one angle and a share, or of a rate and a time, is an angle, so a number beside it may
    // be in deg.
    const bool is_angle = dimension->is_one() && std::abs(type.angle.exponent) == 1;
    if ((is_in_si(a) && is_in_si(b)) || (dimension->is_one() && !is_angle)) type.unit = natural_unit(type);
    if (type.unit && type.unit->offset != 0.0) type.unit.reset();
    return type;
  }

  static std::string in_unit(const Type& type) { return type.unit ? " in " + type.unit->symbol : ""; }

  /// Whether the factor is a number without a unit, or a share of a value that is none.
  static bool is_factor(const Type& factor, const Type& scaled) {
    if (!factor.is_plain() || factor.angle.exponent != 0 || scaled.kind == Type::Kind::bare) return false;
    return factor.kind == Type::Kind::bare || (factor.unit && units::is_si(*factor.unit)) ||
           !scaled.dimension.is_one();
  }

  /// Sets the angle of a product with the given power of `b`. False: its exponent is beyond the limit.
  static bool set_angle(Type& type, const Type& a, const Type& b, int power) {
    const int exponent = a.angle.exponent + power * b.angle.exponent;
    if (std::abs(exponent) > 100) return false;
    type.angle = {.exponent = static_cast<std::int8_t>(exponent),
                  .in_turns = exponent != 0 && (a.angle.in_turns || b.angle.in_turns),
                  .is_open = true};
    const bool is_number = type.dimension.is_one() && exponent == 0 && power != 0;
    type.angle.is_cycles = is_number && counts_cycles(a) != counts_cycles(b);
    return true;
  }

  /// A frequency, or a number of cycles.
  static bool counts_cycles(const Type& type) {
    const bool is_frequency =
        units::is_rate(type.dimension) && type.angle.exponent == 0 && !type.angle.is_open;
    return type.angle.is_cycles || is_frequency;
  }

  Type minus_type(std::size_t i) {
    const std::uint32_t part = nodes_[i].parts[0];
    if (!types_.need_number(i, part)) return {};
    Type type = types_[part];
    if (type.constant) type.constant = -*type.constant;
    // -20 degC is the temperature below zero.
    if (type.is_point()) {
      if (nodes_[part].operation != Operation::number)
        return types_.fail(i, "a temperature" + in_unit(type) + " has no opposite; use K");
      types_.conversion(part) = {};
      types_.conversion(i) = type.unit->to_si();
      type.constant = type.unit->to_si(-nodes_[part].number);
    }
    return type;
  }

  Type power_type(std::size_t i) {
    const std::uint32_t base = nodes_[i].parts[0], exponent = nodes_[i].parts[1];
    if (!types_.need_number(i, base) || !types_.need_number(i, exponent)) return {};
    const Type& a = types_[base];
    if (!types_[exponent].is_plain()) return types_.fail(i, "an exponent is a plain number");
    const auto constant = folded(base, exponent, [](double x, double y) { return std::pow(x, y); });
    if (a.kind == Type::Kind::bare) return {.kind = Type::Kind::bare, .constant = constant};
    if (a.is_plain()) {
      Type type = quantity(si_unit({}));
      type.constant = constant;
      return type;
    }
    const auto& power = types_[exponent].constant;
    if (!power || *power != std::round(*power) || std::abs(*power) > 100.0)
      return types_.fail(
          i, "the exponent of a value in " + unit_text(a) + " is a whole number from -100 to 100");
    if (a.kind == Type::Kind::opaque)
      return types_.fail(i, in_quotes(a.opaque_unit) + " is not a known unit, so its power has none");
    const auto dimension = units::power(a.dimension, static_cast<int>(*power));
    if (!dimension) return types_.fail(i, "the unit of this power has an exponent beyond 100");
    Type type = quantity(*dimension);
    if (!set_angle(type, {}, a, static_cast<int>(*power)))
      return types_.fail(i, "the angle in the unit of this power has an exponent beyond 100");
    if (a.unit && units::is_si(*a.unit)) type.unit = natural_unit(type);
    type.constant = constant;
    return type;
  }

  Type conditional_type(std::size_t i) {
    const auto& parts = nodes_[i].parts;
    if (!types_.need_truth(parts[0], "'if'")) return {};
    if (types_[parts[1]].kind == Type::Kind::truth && types_[parts[2]].kind == Type::Kind::truth)
      return truth();
    const auto both = types_.common_type(i, parts[1], parts[2], BareNumber::is_value);
    return both ? *both : Type{};
  }

  // ---- the result

  /// The result is in the unit of the expression itself.
  void keep_unit(const Type& type) {
    if (type.kind == Type::Kind::opaque) program_.unit_ = type.opaque_unit;
    if (type.kind != Type::Kind::quantity) return;
    const bool is_difference = type.temperature == Temperature::difference;
    const Unit unit = type.unit && !is_difference ? *type.unit : natural_unit(type);
    if (is_difference) {
      program_.value_kind_ = units::ValueKind::difference;
    } else if (type.temperature == Temperature::open || type.angle.is_cycles ||
               (units::is_rate(type.dimension) && type.angle.exponent == 0 && type.angle.is_open)) {
      program_.value_kind_ = units::ValueKind::open;
    }
    if (unit.dimension.is_one() && units::is_si(unit)) return;
    program_.unit_ = unit.symbol;
    convert_to(unit);
  }

  /// The result, which converts to the unit.
  void convert_to(const Unit& unit) {
    const std::size_t last = nodes_.size() - 1;
    const Type& type = types_[last];
    const Operation operation = nodes_[last].operation;
    // Not by way of the SI, where nothing is computed: 3000 rpm are 3000 rpm.
    if (type.unit && (operation == Operation::number || (operation == Operation::name && variables_[last])))
      types_.conversion(last) = *units::conversion(*type.unit, unit);
    else
      program_.to_result_unit_ =
          *units::conversion({.symbol = {}, .dimension = type.dimension, .angle = type.angle}, unit);
  }

  /// The unit of the required result.
  static std::optional<Unit> unit_of(const ResultSpec& spec) {
    auto unit = units::parse_unit(*spec.unit);
    if (!unit || !spec.is_rate) return unit;
    const auto dimension = units::product(unit->dimension, {{0, 0, -1}});
    if (!dimension) return std::nullopt;
    unit->dimension = *dimension;
    unit->angle.is_open = true;
    return unit;
  }

  void check_result(const ResultSpec& spec) {
    const auto last = static_cast<std::uint32_t>(nodes_.size() - 1);
    const Type& type = types_[last];
    if (type.kind == Type::Kind::invalid) return;
    if (!spec.truth && !spec.unit) {
      keep_unit(type);
      return;
    }
    program_.unit_ = spec.truth ? "" : *spec.unit;
    if (spec.truth) {
      if (type.kind != Type::Kind::truth && !type.is_plain())
        types_.fail(last, spec.what + " has to be true or false; this is " + described(type));
      else if (nodes_[last].operation == Operation::number)
        types_.fail(last, spec.what + " has to be true or false; this is a number");
      return;
    }
    const auto unit = unit_of(spec);
    if (spec.is_rate) program_.unit_ += program_.unit_.empty() ? "1/s" : "/s";
    const std::string required = spec.what + " is " + in_unit_text(program_.unit_);
    if (type.kind == Type::Kind::truth) {
      if (!unit || !unit->dimension.is_one()) types_.fail(last, required + "; this is true or false");
      return;
    }
    if (type.kind == Type::Kind::bare) return;  // it takes the unit
    if (!unit || type.kind == Type::Kind::opaque) {
      if (type.kind == Type::Kind::opaque && type.opaque_unit == program_.unit_) return;
      types_.fail(last, required + "; this is " + in_unit_text(type));
      return;
    }
    if (unit->dimension != type.dimension ||
        !units::two_pi_exponent_between(type.dimension, type.angle, unit->angle)) {
      types_.fail(last, required + "; this is " + in_unit_text(type) +
                            (unit->dimension == type.dimension
                                 ? units::angle_hint(type.dimension, type.angle, unit->angle)
                                 : ""));
      return;
    }
    types_.warn_of_missing_unit(last, quantity(*unit));
    if (spec.is_difference && !types_.take_difference(last, spec.what)) return;
    if (type.temperature == Temperature::difference) {
      if (unit->offset != 0.0) {
        types_.fail(last, required + "; this is a difference, which is in K");
        return;
      }
      program_.value_kind_ = units::ValueKind::difference;
    }
    convert_to(*unit);
  }

  // ---- instructions

  double period_s() const { return static_cast<double>(options_.period_ns) / 1e9; }

  void add(const Program::Instruction& instruction) { program_.instructions_.push_back(instruction); }

  void push() { max_depth_ = std::max(max_depth_, ++depth_); }

  void write(std::size_t i) {
    const Node& node = nodes_[i];
    if (variables_[i]) {
      program_.variables_.push_back(variables_[i]->index);
      add({.code = Code::variable, .index = variables_[i]->index, .conversion = types_.conversion(i)});
      push();
      return;
    }
    for (const std::uint32_t part : node.parts) {
      write(part);
      if (types_.is_tested(part)) add({.code = Code::truth_of_number});
    }
    depth_ -= node.parts.size();
    if (node.operation == Operation::call) {
      if (const Table* table = scope_.find_table(node.word.text)) {
        add({.code = Code::table,
             .table = table,
             .arguments = static_cast<std::uint32_t>(node.parts.size())});
      } else {
        write_call(i);
      }
    } else if (named_[i]) {
      add({.code = Code::number, .number = *named_[i]});
    } else if (node.operation == Operation::number || node.operation == Operation::truth) {
      add({.code = Code::number, .number = node.number});
    } else if (node.operation == Operation::name) {
      add({.code = Code::time});
    } else {
      add({.code = Code::operation, .operation = node.operation});
    }
    push();
    if (!types_.conversion(i).is_identity()) add({.code = Code::convert, .conversion = types_.conversion(i)});
  }

  void write_call(std::size_t i) {
    const Node& node = nodes_[i];
    const Function* function = function_named(node.word.text);
    Program::Instruction call{.code = Code::call, .function = function};
    program_.may_have_lower_bound_ = program_.may_have_lower_bound_ || function->may_be_lower_bound;
    call.arguments = static_cast<std::uint32_t>(node.parts.size());
    program_.arguments_.resize(std::max(program_.arguments_.size(), node.parts.size()));
    call.constants = {.period_s = period_s(), .seed = options_.seed + 0x9E3779B97F4A7C15u * (i + 1)};
    call.state_size = function->state_size;
    if (function->state_per_period)
      call.state_size += static_cast<std::uint32_t>(std::round(*types_[node.parts[1]].constant / period_s()));
    if (call.state_size > 0) {
      call.first_state = static_cast<std::uint32_t>(program_.state_.size());
      call.last_result = static_cast<std::uint32_t>(program_.last_results_.size());
      program_.state_.resize(program_.state_.size() + call.state_size);
      program_.last_results_.emplace_back();
    }
    add(call);
  }

  const std::string& text_;
  const std::span<const Node> nodes_;
  OperandTypes types_;
  const Scope& scope_;
  const CompileOptions& options_;
  Diagnostics& diagnostics_;
  std::vector<bool> is_untyped_;                    ///< by node: it has no type, as arguments of relations
  std::vector<std::optional<Variable>> variables_;  ///< of names and relations
  std::vector<std::optional<double>> named_;        ///< values of value names
  std::string unit_in_parentheses_;                 ///< the last one that was reported
  Program program_;
  std::size_t depth_ = 0, max_depth_ = 0;
};

std::optional<Program> Program::compile(const Expression& expression, const Scope& scope,
                                        const ResultSpec& spec, const CompileOptions& options,
                                        Diagnostics& diagnostics) {
  return Compiler(expression, scope, options, diagnostics).compile(spec);
}

}  // namespace hil::expression
