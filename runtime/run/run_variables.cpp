#include "runtime/run/run_variables.hpp"

#include <algorithm>
#include <cmath>
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
    expression::ResultSpec spec{.unit = std::nullopt, .what = "'" + variable.name.text + "'"};
    if (variable.unit) spec.unit = variable.unit->text;
    auto compiled = signals::SignalExpression::compile(
        *variable.expression, known, spec,
        {.period_ns = scenario.base_period_ns, .seed = scenario.seed - 0x9E3779B97F4A7C15u * (i + 1)},
        diagnostics);
    if (!compiled) {
      known.add_undeclared(variable.name.text);
      continue;
    }
    signals::SignalExpression before_the_run = *compiled;
    const signals::SignalId signal = known.table().add(
        {.name = variable.name.text,
         .unit = compiled->unit(),
         .writer = "variables",
         .initial = before_the_run.evaluate(known.table(), 0, signals::Unpublished::initial_value),
         .value_kind = compiled->value_kind()});
    if (const double value = compiled->value_in_all_steps(&known); !std::isnan(value))
      known.set_constant(signal, value);
    if (const auto& nodes = variable.expression->nodes(); nodes.size() == 1)
      known.set_source(variable.name.text, nodes.front().word.text);
    // What reads the variable reads what it is computed from.
    for (signals::ReadObserver* const observer : known.table().read_observers(compiled->signals()))
      known.table().add_read_observer(signal, *observer);
    variables_.push_back({signal, std::move(*compiled)});
  }
}

void RunVariables::update(Variable& variable, signals::SignalTable& table,
                          signals::Instant instant) noexcept {
  const double value = variable.expression.evaluate(table, instant, signals::Unpublished::unknown);
  const std::int64_t written_ns =
      std::clamp(variable.expression.newest_ns(), std::int64_t{0}, instant.time_ns);
  table.write(variable.signal,
              signals::SignalValue{.value = value,
                                   .time_ns = written_ns,
                                   .fresh = true,
                                   .spread_ns = written_ns - variable.expression.oldest_ns()});
}

void RunVariables::update(signals::SignalTable& table, std::int64_t time_ns) noexcept {
  for (Variable& variable : variables_)
    update(variable, table, {.time_ns = time_ns});
}

void RunVariables::update_at_frame(signals::SignalTable& table, std::int64_t time_ns,
                                   std::span<const std::uint32_t> numbers) noexcept {
  for (const std::uint32_t number : numbers)
    update(variables_[number], table, {.time_ns = time_ns, .is_tick = false});
}

std::vector<std::uint32_t> RunVariables::numbers_reading(std::span<const signals::SignalId> signals) const {
  std::vector<signals::SignalId> changing(signals.begin(), signals.end());
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t number = 0; number < variables_.size(); ++number) {
    const std::vector<signals::SignalId>& read = variables_[number].expression.signals();
    if (std::ranges::find_first_of(read, changing) == read.end()) continue;
    numbers.push_back(number);
    changing.push_back(variables_[number].signal);
  }
  return numbers;
}

std::vector<signals::SignalId> RunVariables::with_sources(std::vector<signals::SignalId> signals) const {
  for (auto variable = variables_.rbegin(); variable != variables_.rend(); ++variable) {
    if (std::ranges::find(signals, variable->signal) == signals.end()) continue;
    for (const signals::SignalId source : variable->expression.signals())
      if (std::ranges::find(signals, source) == signals.end()) signals.push_back(source);
  }
  return signals;
}

}  // namespace hil::run
