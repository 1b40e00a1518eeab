#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "runtime/config/numbers.hpp"
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
      : nodes_(expression.nodes()),
        types_(nodes_, diagnostics),
        scope_(scope),
        options_(options),
        diagnostics_(diagnostics),
        is_untyped_(relation_arguments(nodes_)),
        variables_(nodes_.size()),
        named_(nodes_.size()) {}

  std::optional<Program> compile(const Wanted& wanted) {
    const std::size_t before = diagnostics_.count();
    for (const Node& node : nodes_) {
      if (!calls_unknown_function(node)) continue;
      for (const std::uint32_t part : node.parts)
        is_untyped_[part] = true;  // one mistake, of the call
    }
    for (std::size_t i = 0; i < nodes_.size(); ++i)
      if (!is_untyped_[i]) types_[i] = type_of(i);
    want(wanted);
    if (diagnostics_.count() != before || types_[nodes_.size() - 1].kind == Type::Kind::invalid)
      return std::nullopt;
    write(nodes_.size() - 1);
    if (wanted.truth && types_[nodes_.size() - 1].kind != Type::Kind::truth)
      add({.code = Program::Code::truth_of_number});
    program_.stack_.resize(max_depth_);
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
    types_.conversion(i) = {node.unit->numerator, node.unit->denominator, node.unit->offset};
    Type type = quantity(*node.unit);
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
    types_.conversion(i) = {unit->numerator, unit->denominator, unit->offset};
    return quantity(*unit);
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
    diagnostics_.add(word.place, "there is no " + scope_.noun() + " " + in_quotes(word.text) +
                                     config::suggestion(word.text, scope_.names()));
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
    const auto both = types_.joined(i, left, right, Offset::of_values);
    if (!both) return {};
    for (const auto& [part, other] : {std::pair(left, right), std::pair(right, left)}) {
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
    auto both = types_.joined(i, left, right, Offset::of_changes);
    if (!both) return {};
    const bool is_sum = nodes_[i].operation == Operation::add;
    // A temperature and a difference make a temperature, two temperatures a difference.
    if (both->unit && both->unit->offset != 0.0) {
      both->unit.reset();
      both->is_difference = !is_sum;
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
    Type type = quantity(*dimension);
    const auto has_unit = [](const Type& part) { return part.unit && part.unit->offset == 0.0; };
    const auto is_in_si = [](const Type& part) {
      return part.kind == Type::Kind::bare || (part.unit && is_si(*part.unit));
    };
    // A plain factor leaves the unit of the other one: twice a value in % is in %.
    if (b.is_plain() && has_unit(a))
      type.unit = a.unit;
    else if (a.is_plain() && !divides && has_unit(b))
      type.unit = b.unit;
    else if (is_in_si(a) && is_in_si(b))
      type.unit = si_unit(*dimension);
    type.constant = constant;
    return type;
  }

  Type minus_type(std::size_t i) {
    const std::uint32_t part = nodes_[i].parts[0];
    if (!types_.need_number(i, part)) return {};
    Type type = types_[part];
    if (type.constant) type.constant = -*type.constant;
    // -20 degC is the temperature below zero.
    if (type.unit && type.unit->offset != 0.0) {
      if (nodes_[part].operation != Operation::number)
        return types_.fail(i, "a temperature in " + type.unit->symbol + " has no opposite; use K");
      types_.conversion(part) = {};
      types_.conversion(i) = {type.unit->numerator, type.unit->denominator, type.unit->offset};
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
    if (a.is_plain()) {
      Type type = a;
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
    if (a.unit && is_si(*a.unit)) type.unit = si_unit(*dimension);
    type.constant = constant;
    return type;
  }

  Type conditional_type(std::size_t i) {
    const auto& parts = nodes_[i].parts;
    if (!types_.need_truth(parts[0], "'if'")) return {};
    if (types_[parts[1]].kind == Type::Kind::truth && types_[parts[2]].kind == Type::Kind::truth)
      return truth();
    const auto both = types_.joined(i, parts[1], parts[2], Offset::of_values);
    return both ? *both : Type{};
  }

  // ---- the result

  static std::string unit_name(const std::string& unit) { return unit.empty() ? "a plain number" : unit; }

  /// The result is in the unit of the expression itself.
  void keep_unit(const Type& type) {
    if (type.kind == Type::Kind::opaque) program_.unit_ = type.opaque_unit;
    if (type.kind != Type::Kind::quantity) return;
    const Unit unit = type.unit && !type.is_difference ? *type.unit : si_unit(type.dimension);
    if (unit.dimension.is_one() && is_si(unit)) return;
    program_.unit_ = unit.symbol;
    program_.to_wanted_ = *units::conversion(si_unit(unit.dimension), unit);
  }

  void want(const Wanted& wanted) {
    const auto last = static_cast<std::uint32_t>(nodes_.size() - 1);
    const Type& type = types_[last];
    if (type.kind == Type::Kind::invalid) return;
    if (!wanted.truth && !wanted.unit) {
      keep_unit(type);
      return;
    }
    program_.unit_ = wanted.truth ? "" : *wanted.unit;
    if (wanted.truth) {
      if (type.kind != Type::Kind::truth && !type.is_plain())
        types_.fail(last, wanted.what + " has to be true or false; this is a value in " + unit_text(type));
      else if (nodes_[last].operation == Operation::number)
        types_.fail(last, wanted.what + " has to be true or false; this is a number");
      return;
    }
    const auto unit = units::parse_unit(*wanted.unit);
    if (type.kind == Type::Kind::truth) {
      if (!unit || !unit->dimension.is_one())
        types_.fail(last, wanted.what + " is in " + unit_name(*wanted.unit) + "; this is true or false");
      return;
    }
    if (type.kind == Type::Kind::bare) return;  // it has the wanted unit
    if (!unit || type.kind == Type::Kind::opaque) {
      if (type.kind == Type::Kind::opaque && type.opaque_unit == *wanted.unit) return;
      types_.fail(last,
                  wanted.what + " is in " + unit_name(*wanted.unit) + "; this is in " + unit_text(type));
      return;
    }
    if (unit->dimension != type.dimension) {
      types_.fail(last,
                  wanted.what + " is in " + unit_name(*wanted.unit) + "; this is in " + unit_text(type));
      return;
    }
    if (type.is_difference && unit->offset != 0.0) {
      types_.fail(last, wanted.what + " is in " + *wanted.unit + "; this is a difference, which is in K");
      return;
    }
    program_.to_wanted_ = *units::conversion(si_unit(unit->dimension), *unit);
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

  const std::span<const Node> nodes_;
  OperandTypes types_;
  const Scope& scope_;
  const CompileOptions& options_;
  Diagnostics& diagnostics_;
  std::vector<bool> is_untyped_;                    ///< by node: it has no type, as arguments of relations
  std::vector<std::optional<Variable>> variables_;  ///< of names and relations
  std::vector<std::optional<double>> named_;        ///< values of value names
  Program program_;
  std::size_t depth_ = 0, max_depth_ = 0;
};

std::optional<Program> Program::compile(const Expression& expression, const Scope& scope,
                                        const Wanted& wanted, const CompileOptions& options,
                                        Diagnostics& diagnostics) {
  return Compiler(expression, scope, options, diagnostics).compile(wanted);
}

}  // namespace hil::expression
