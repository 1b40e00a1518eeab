#include "runtime/run/run_variables.hpp"

#include <utility>

#include "runtime/expression/definition_order.hpp"

namespace hil::run {
namespace {

/// False with a mistake: no expression can have the name, or the unit is none.
bool is_sound(const config::VariableSection& variable, const signals::SignalTable& table,
              config::Diagnostics& diagnostics) {
  const std::string& name = variable.name.text;
  if (config::is_reserved_word(name)) {
    diagnostics.add(variable.name.place,
                    "'" + name + "' is a word of the expression language; give the variable another name");
    return false;
  }
  if (table.find(name)) {
    diagnostics.add(variable.name.place, "there is a signal '" + name + "'; give the variable another name");
    return false;
  }
  if (variable.unit && !units::parse_unit(variable.unit->text)) {
    diagnostics.add(variable.unit->place, config::in_quotes(variable.unit->text) + " is not a known unit");
    return false;
  }
  return true;
}

}  // namespace

void RunVariables::declare(const config::Scenario& scenario, signals::KnownSignals& known,
                           config::Diagnostics& diagnostics) {
  std::vector<expression::Definition> definitions;
  for (const config::VariableSection& variable : scenario.variables) {
    definitions.push_back({variable.name, variable.expression});
    if (!is_sound(variable, known.table(), diagnostics)) definitions.back().expression.reset();
  }
  const std::vector<std::size_t> order = expression::definition_order(definitions, diagnostics);
  std::vector<char> has_place(definitions.size());
  for (const std::size_t i : order)
    has_place[i] = 1;
  for (std::size_t i = 0; i < definitions.size(); ++i)
    if (has_place[i] == 0) known.add_undeclared(definitions[i].name.text);
  for (const std::size_t i : order) {
    const config::VariableSection& variable = scenario.variables[i];
    expression::Wanted wanted{.unit = std::nullopt, .what = "'" + variable.name.text + "'"};
    if (variable.unit) wanted.unit = variable.unit->text;
    auto compiled = signals::SignalExpression::compile(
        *variable.expression, known, wanted,
        {.period_ns = scenario.base_period_ns, .seed = scenario.seed - 0x9E3779B97F4A7C15u * (i + 1)},
        diagnostics);
    if (!compiled) {
      known.add_undeclared(variable.name.text);
      continue;
    }
    signals::SignalExpression before_the_run = *compiled;
    const signals::SignalId signal = known.table().add({.name = variable.name.text,
                                                        .unit = compiled->unit(),
                                                        .writer = "variables",
                                                        .initial = before_the_run.evaluate(known.table(), 0),
                                                        .meaning = compiled->meaning()});
    // What reads the variable reads what it is computed from.
    for (signals::ReadObserver* const observer : known.table().read_observers(compiled->signals()))
      known.table().add_read_observer(signal, *observer);
    variables_.push_back({signal, std::move(*compiled)});
  }
}

void RunVariables::update(signals::SignalTable& table, std::int64_t time_ns) noexcept {
  for (Variable& variable : variables_)
    table.write(variable.signal, variable.expression.evaluate(table, time_ns), time_ns);
}

}  // namespace hil::run
