#include "runtime/modules/block/compile_block.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>

#include <hil/numbers.hpp>
#include <hil/splitmix64.hpp>

#include "runtime/expression/definition_order.hpp"
#include "runtime/modules/block/block_names.hpp"

namespace hil::modules {
namespace {

using config::Diagnostics;
using config::Expression;
using config::in_quotes;
using config::Value;
using expression::ResultSpec;

std::uint64_t hash_of(const std::string& text) {
  std::uint64_t hash = 0;
  for (const char letter : text)
    hash = splitmix64(hash ^ static_cast<unsigned char>(letter));
  return hash;
}

/// Sections in their order: tables, parameters, inputs, states and machines get their values' places; then
/// expressions are compiled, those of variables after the variables that they read.
class BlockCompiler {
 public:
  BlockCompiler(const Value& parameters, const TaskParameters& task, Diagnostics& diagnostics)
      : section_(parameters),
        task_(task),
        diagnostics_(diagnostics),
        seed_(task.seed ^ hash_of(task.instance)) {}

  std::optional<CompiledBlock> compile() {
    const std::size_t before = diagnostics_.count();
    equations_.runge_kutta = section_["integrator"].text() == "rk4";
    declare_names();
    add_inputs();
    add_tables();
    add_parameters();
    add_states();
    add_machines();
    add_variables();
    compile_states();
    compile_machines();
    if (section_.has("outputs"))
      add_outputs();
    else
      add_all_as_outputs();
    if (diagnostics_.count() == before && equations_.outputs.empty())
      diagnostics_.add(section_.place(), "the block has no outputs, states, variables or state machines");
    if (diagnostics_.count() != before) return std::nullopt;
    warn_of_unused();
    const std::size_t inputs = section_["inputs"].entries().size();
    return CompiledBlock{std::move(equations_), std::move(ports_), std::move(input_values_), inputs};
  }

 private:
  /// `each(name, place of the name, value)`.
  template <typename Each>
  void for_each(const Value& map, const Each& each) {
    for (std::size_t i = 0; i < map.entries().size(); ++i)
      each(map.entries()[i].first, map.key_place(i), map.entries()[i].second);
  }

  void declare_names() {
    const std::pair<const char*, const char*> sections[] = {{"inputs", "input"},
                                                            {"tables", "table"},
                                                            {"parameters", "parameter"},
                                                            {"states", "state"},
                                                            {"state_machines", "state machine"},
                                                            {"variables", "variable"}};
    for (const auto& [section, what] : sections) {
      for_each(section_[section],
               [&, what = what](const std::string& name, const config::Place& place, const Value&) {
                 names_.declare(what, name, place, diagnostics_);
               });
    }
  }

  std::uint32_t add_value(double initial) {
    equations_.initial_values.push_back(initial);
    return static_cast<std::uint32_t>(equations_.initial_values.size() - 1);
  }

  /// A new number for each expression, so that each has random numbers of its own.
  std::uint64_t next_seed() { return splitmix64(seed_ + splitmix64_step * ++expressions_); }

  std::optional<Program> compiled(const Expression& expression, const ResultSpec& spec) {
    return Program::compile(expression, names_, spec, {.period_ns = task_.period_ns, .seed = next_seed()},
                            diagnostics_);
  }
  std::optional<Program> compiled(const Value& text, const ResultSpec& spec) {
    const auto expression = Expression::parse(text, diagnostics_);
    return expression ? compiled(*expression, spec) : std::nullopt;
  }
  std::optional<Program> compiled(const Value& section, const std::string& field, const ResultSpec& spec) {
    return section.has(field) ? compiled(section[field], spec) : std::nullopt;
  }

  struct Constant {
    double value = 0.0;
    std::string unit;
    units::ValueKind value_kind = units::ValueKind::as_unit;
  };
  /// The value of an expression of parameters.
  std::optional<Constant> constant(const Expression& expression, const ResultSpec& spec) {
    for (const Expression::Node& node : expression.nodes()) {
      if (node.operation != Expression::Operation::name || node.word.text != "time") continue;
      diagnostics_.add(node.word.place, spec.what + " is constant, and 'time' is not");
      return std::nullopt;
    }
    auto program = Program::compile(expression, constants_, spec, {}, diagnostics_);
    if (!program) return std::nullopt;
    const double value = program->evaluate(equations_.initial_values, 0.0);
    if (!std::isfinite(value)) {
      diagnostics_.add(expression.place(), spec.what + " has no finite value");
      return std::nullopt;
    }
    return Constant{value, program->unit(), program->value_kind()};
  }
  std::optional<Constant> constant(const Value& text, const ResultSpec& spec) {
    const auto expression = Expression::parse(text, diagnostics_);
    return expression ? constant(*expression, spec) : std::nullopt;
  }

  bool is_known_unit(const Value& unit) {
    if (units::parse_unit(unit.text())) return true;
    diagnostics_.add(unit.place(), in_quotes(unit.text()) + " is not a known unit");
    return false;
  }
  /// "1" is the unit of plain numbers.
  static std::string unit_of(const Value& unit) { return unit.text() == "1" ? "" : unit.text(); }
  ResultSpec result_spec(const Value& section, const std::string& name) {
    ResultSpec spec{.unit = std::nullopt, .what = in_quotes(name)};
    if (section.has("unit") && is_known_unit(section["unit"])) spec.unit = unit_of(section["unit"]);
    return spec;
  }

  // ---- places of values

  void add_inputs() {
    for_each(section_["inputs"], [&](const std::string& name, const config::Place&, const Value& input) {
      if (!is_known_unit(input["unit"])) {
        names_.set_broken(name);
        names_.set_broken(name + ".fresh");
      }
      const std::string unit = unit_of(input["unit"]);
      std::map<std::string, double> values;
      for (const auto& [word, number] : input["values"].entries())
        values.emplace(word, number.number());
      const auto given = task_.value_names.find(name);
      const bool has_given = values.empty() && given != task_.value_names.end();
      if (has_given) values = in_unit(unit, given->second);
      input_values_.push_back(add_value(0.0));
      names_.define(name, input_values_.back(), unit, values, has_given && given->second.accepts_any_name);
      names_.define(name + ".fresh", add_value(0.0), "");
      ports_.inputs.push_back({.name = name,
                               .unit = unit,
                               .about = "input of the block",
                               .required = !input.has("initial"),
                               .named_values = values});
    });
  }

  /// As the values of the signal are converted for the input.
  static std::map<std::string, double> in_unit(const std::string& unit, const ValueNames& names) {
    const auto conversion = units::signal_conversion(names.unit, unit);
    if (!conversion) return names.values;  // a mistake of the connection
    std::map<std::string, double> values;
    for (const auto& [name, value] : names.values)
      values.emplace(name, conversion->of(value));
    return values;
  }

  void add_tables() {
    for_each(section_["tables"], [&](const std::string& name, const config::Place&, const Value& section) {
      auto table = expression::Table::read(section, diagnostics_);
      if (!table) {
        set_broken(name);
        return;
      }
      equations_.tables.push_back(std::make_shared<const expression::Table>(std::move(*table)));
      names_.define_table(name, *equations_.tables.back());
      constants_.define_table(name, *equations_.tables.back());
    });
  }

  void add_parameters() {
    const Value& parameters = section_["parameters"];
    std::vector<Port> parameter_ports;
    std::vector<std::uint32_t> parameter_values;
    for_each_in_order(parameters, [&](const std::string& name, const Expression& expression, const Value&) {
      const auto value = constant(expression, {.unit = std::nullopt, .what = "parameter " + in_quotes(name)});
      if (!value) return;
      const std::uint32_t place = add_value(value->value);
      names_.define(name, place, value->unit, {}, false, value->value_kind);
      constants_.define(name, place, value->unit, {}, false, value->value_kind);
      parameter_ports.push_back(
          {.name = name, .unit = value->unit, .about = "parameter of the block", .initial = value->value});
      parameter_values.push_back(place);
    });
    // Inputs come before the parameters, but their initial values may be made of them.
    std::size_t i = 0;
    for_each(section_["inputs"], [&](const std::string& name, const config::Place&, const Value& input) {
      Port& port = ports_.inputs[i++];
      if (!input.has("initial")) return;
      if (const auto value = constant(input["initial"], {.unit = port.unit, .what = in_quotes(name)}))
        port.initial = value->value;
    });
    ports_.inputs.insert(ports_.inputs.end(), parameter_ports.begin(), parameter_ports.end());
    input_values_.insert(input_values_.end(), parameter_values.begin(), parameter_values.end());
  }

  void set_broken(const std::string& name) {
    names_.set_broken(name);
    constants_.set_broken(name);
  }

  void add_states() {
    for_each(section_["states"], [&](const std::string& name, const config::Place& place,
                                     const Value& section) {
      const ResultSpec spec = result_spec(section, name);
      const auto initial = constant(section["initial"], spec);
      equations_.states.push_back({.name = name});
      if (!initial) {
        set_broken(name);
        return;
      }
      BlockState& state = equations_.states.back();
      state.value = add_value(initial->value);
      state.initial = initial->value;
      names_.define(name, state.value, initial->unit, {}, false, initial->value_kind);
      if (section.has("derivative") && section.has("next"))
        diagnostics_.add(place, "'" + name + "' has a derivative and a next value; a state has one of them");
    });
  }

  void add_machines() {
    for_each(section_["state_machines"],
             [&](const std::string& name, const config::Place& place, const Value& section) {
               BlockMachine machine{.name = name, .has_events = section["events"].boolean()};
               std::map<std::string, double> numbers;
               for (const auto& [state, value] : section["states"].entries()) {
                 numbers.emplace(state, static_cast<double>(machine.states.size()));
                 machine.states.push_back({.name = state});
               }
               if (machine.states.size() < 2)
                 diagnostics_.add(place, "a state machine has at least two states");
               if (section.has("initial")) {
                 if (const auto initial = index_in(machine, section["initial"])) machine.initial = *initial;
               }
               machine.value = add_value(machine.initial);
               machine.time = add_value(0.0);
               names_.define(name, machine.value, "", numbers);
               names_.define(name + ".time", machine.time, "s");
               equations_.machines.push_back(std::move(machine));
             });
  }

  /// Empty with a mistake: there is no such state.
  std::optional<std::uint32_t> index_in(const BlockMachine& machine, const Value& name) {
    std::vector<std::string> names;
    for (const BlockMachineState& state : machine.states)
      names.push_back(state.name);
    const auto found = std::ranges::find(names, name.text());
    if (found != names.end()) return static_cast<std::uint32_t>(found - names.begin());
    diagnostics_.add(name.place(), "the state machine " + in_quotes(machine.name) + " has no state " +
                                       in_quotes(name.text()) + config::suggestion(name.text(), names));
    return std::nullopt;
  }

  /// Calls `each(name, expression, section)` for the entries of a map, each after those that it reads.
  template <typename Each>
  void for_each_in_order(const Value& map, const Each& each) {
    std::vector<expression::Definition> definitions;
    const auto text_of = [](const Value& value) -> const Value& {
      return value.kind() == config::Kind::text ? value : value["value"];
    };
    for_each(map, [&](const std::string& name, const config::Place& place, const Value& value) {
      definitions.push_back({{name, place}, Expression::parse(text_of(value), diagnostics_)});
      set_broken(name);  // until it is defined
    });
    for (const std::size_t i : expression::definition_order(definitions, diagnostics_))
      each(definitions[i].name.text, *definitions[i].expression, map.entries()[i].second);
  }

  // ---- expressions

  void add_variables() {
    for_each_in_order(section_["variables"],
                      [&](const std::string& name, const Expression& expression, const Value& section) {
                        auto program = compiled(expression, result_spec(section, name));
                        if (!program) return;
                        const std::uint32_t place = add_value(0.0);
                        names_.define(name, place, program->unit(), {}, false, program->value_kind());
                        equations_.variables.push_back({place, std::move(*program)});
                      });
  }

  void compile_states() {
    std::size_t i = 0;
    for_each(section_["states"], [&](const std::string& name, const config::Place&, const Value& section) {
      BlockState& state = equations_.states[i++];
      const expression::Variable* const variable = names_.defined(name);
      if (variable == nullptr) return;
      const auto spec_of = [&](const char* what) {
        return ResultSpec{.unit = variable->unit, .what = std::string(what) + in_quotes(name)};
      };
      state.derivative = compiled_derivative(section, name, variable->unit, state.unit_per_derivative);
      state.next = compiled(section, "next", spec_of("the next value of "));
      state.min = compiled(section, "min", spec_of("the least value of "));
      state.max = compiled(section, "max", spec_of("the largest value of "));
      check_initial(state, section, variable->unit);
      if (!section.has("reset")) return;
      const Value& reset = section["reset"];
      auto when = compiled(reset["when"], {.truth = true, .what = "'when'"});
      auto to = compiled(reset["to"], spec_of("the value of "));
      if (when && to) state.reset = BlockReset{std::move(*when), std::move(*to)};
    });
  }

  std::optional<Program> compiled_derivative(const Value& section, const std::string& name,
                                             const std::string& unit, double& unit_per_derivative) {
    const units::DifferenceUnit difference = units::difference_unit(unit);
    unit_per_derivative = difference.factor;
    return compiled(
        section, "derivative",
        {.unit = difference.symbol, .is_rate = true, .what = "the derivative of " + in_quotes(name)});
  }

  /// Limits that are constants contain the initial value.
  void check_initial(const BlockState& state, const Value& section, const std::string& unit) {
    const auto check = [&](const std::optional<Program>& limit, const char* field, double sign) {
      if (!limit || limit->has_state()) return;
      Program program = *limit;
      for (const std::uint32_t read : program.variables())
        if (!is_parameter(read)) return;
      const double value = program.evaluate(equations_.initial_values, 0.0);
      if (!(sign * (state.initial - value) > 0.0)) return;
      const auto text = [&](double number) { return config::format_number(number, 6) + " " + unit; };
      diagnostics_.add(section["initial"].place(), in_quotes(state.name) + " begins at " +
                                                       text(state.initial) + ", but its '" + field + "' is " +
                                                       text(value));
    };
    check(state.min, "min", -1.0);
    check(state.max, "max", 1.0);
  }
  bool is_parameter(std::uint32_t value) const {
    return std::ranges::any_of(section_["parameters"].entries(), [&](const auto& entry) {
      const expression::Variable* const parameter = names_.defined(entry.first);
      return parameter != nullptr && parameter->index == value;
    });
  }

  void compile_machines() {
    std::size_t m = 0;
    for (const auto& [name, section] : section_["state_machines"].entries()) {
      BlockMachine& machine = equations_.machines[m++];
      std::size_t s = 0;
      for (const auto& [state_name, state] : section["states"].entries()) {
        BlockMachineState& compiled_state = machine.states[s++];
        for_each(state["entry"], [&](const std::string& target, const config::Place& place,
                                     const Value& text) { add_action(compiled_state, target, place, text); });
        for (const Value& transition : state["transitions"].items())
          add_transition(machine, compiled_state, transition);
      }
    }
  }

  void add_action(BlockMachineState& state, const std::string& target, const config::Place& place,
                  const Value& text) {
    const auto found = std::ranges::find(equations_.states, target, &BlockState::name);
    if (found == equations_.states.end()) {
      std::vector<std::string> names;
      for (const BlockState& known : equations_.states)
        names.push_back(known.name);
      diagnostics_.add(place, "an entry action sets a state of the block, and there is no state " +
                                  in_quotes(target) + config::suggestion(target, names));
      return;
    }
    const expression::Variable* const variable = names_.defined(target);
    if (variable == nullptr) return;
    auto program = compiled(text, {.unit = variable->unit, .what = in_quotes(target)});
    if (!program) return;
    if (program->has_state()) {
      diagnostics_.add(text.place(),
                       "an entry action is computed once, so its functions have no memory; make a variable");
      return;
    }
    state.entry.push_back({variable->index, std::move(*program)});
  }

  /// In seconds. A plain number is none.
  std::optional<Program> compiled_duration(const Value& section, const std::string& field) {
    const auto natural = compiled(section, field, {.unit = std::nullopt, .what = "'" + field + "'"});
    if (!natural) return std::nullopt;
    const auto unit = units::parse_unit(natural->unit());
    if (unit && unit->dimension == units::Dimension{{0, 0, 1}})
      return compiled(section, field, {.unit = "s"});
    diagnostics_.add(section[field].place(), "'" + field + "' is a duration, as '20 ms'");
    return std::nullopt;
  }

  void add_transition(const BlockMachine& machine, BlockMachineState& state, const Value& section) {
    const auto to = index_in(machine, section["to"]);
    if (!section.has("when") && !section.has("after"))
      diagnostics_.add(section.place(), "a transition needs 'when', 'after' or both");
    auto when = compiled(section, "when", {.truth = true, .what = "'when'"});
    auto after = compiled_duration(section, "after");
    if (to) state.transitions.push_back({*to, std::move(when), std::move(after)});
  }

  // ---- outputs

  void add_outputs() {
    for_each(section_["outputs"], [&](const std::string& name, const config::Place&, const Value& section) {
      const std::string& text = section["value"].text();
      const std::optional<expression::Variable> variable = names_.find(text);
      if (variable && !section.has("unit")) {
        add_output(name, *variable);
        return;
      }
      auto program = compiled(section["value"], result_spec(section, name));
      if (!program) return;
      ports_.outputs.push_back({.name = name,
                                .unit = program->unit(),
                                .about = "output of the block",
                                .value_kind = program->value_kind()});
      equations_.outputs.push_back({0, std::move(program)});
    });
  }

  void add_output(const std::string& name, const expression::Variable& variable) {
    Port port{.name = name,
              .unit = variable.unit,
              .about = "output of the block",
              .value_kind = variable.value_kind};
    if (variable.named_values != nullptr) port.named_values = *variable.named_values;
    ports_.outputs.push_back(std::move(port));
    equations_.outputs.push_back({variable.index, std::nullopt});
  }

  void add_all_as_outputs() {
    for (const char* const section : {"states", "variables", "state_machines"}) {
      for (const auto& [name, value] : section_[section].entries())
        if (const expression::Variable* const variable = names_.defined(name)) add_output(name, *variable);
    }
  }

  /// A parameter that --set misspells is one that nothing reads.
  void warn_of_unused() {
    const std::pair<const char*, const char*> sections[] = {
        {"parameters", "parameter"}, {"inputs", "input"}, {"tables", "table"}};
    for (const auto& [section, what] : sections) {
      for_each(section_[section],
               [&, what = what](const std::string& name, const config::Place& place, const Value&) {
                 if (names_.is_used(name) || names_.is_used(name + ".fresh") || constants_.is_used(name))
                   return;
                 diagnostics_.warn(
                     place, std::string("no expression of the block uses the ") + what + " '" + name + "'");
               });
    }
  }

  const Value& section_;
  const TaskParameters& task_;
  Diagnostics& diagnostics_;
  const std::uint64_t seed_;
  std::uint64_t expressions_ = 0;
  BlockNames names_{"input, parameter, state or variable"}, constants_{"parameter"};
  BlockEquations equations_;
  Ports ports_;
  std::vector<std::uint32_t> input_values_;  ///< by input of the ports
};

}  // namespace

std::optional<CompiledBlock> compile_block(const Value& parameters, const TaskParameters& task,
                                           Diagnostics& diagnostics) {
  return BlockCompiler(parameters, task, diagnostics).compile();
}

}  // namespace hil::modules
