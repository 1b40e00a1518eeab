#include "runtime/signals/known_signals.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace hil::signals {

void KnownSignals::add_relations(const config::Expression& expression) const {
  if (relations_ == nullptr) return;
  for (std::size_t i = 0; i < expression.nodes().size(); ++i) {
    if (!expression::is_relation(expression.nodes()[i])) continue;
    auto relation = expression::relation_of(expression.nodes(), i);
    if (!relation) continue;  // reported when the expression is compiled
    std::string name = expression::relation_name(*relation);
    if (table_.find(name)) continue;
    relations_->signals.push_back(table_.add({.name = std::move(name),
                                              .unit = std::string(relation->function->unit),
                                              .writer = relations_->writer,
                                              .initial = std::numeric_limits<double>::quiet_NaN()}));
    relations_->relations.push_back(std::move(*relation));
  }
}

SignalId KnownSignals::find(const config::Word& name, config::Diagnostics& diagnostics) const {
  if (const auto found = table_.find(name.text)) {
    const auto imprecise = imprecise_.find(found->index);
    if (imprecise != imprecise_.end())
      diagnostics.warn(name.place, "'" + name.text + "' " + imprecise->second);
    return *found;
  }
  if (is_undeclared(name.text)) return {};
  if (name.text.find('(') != std::string::npos) return find_relation(name, diagnostics);
  diagnostics.add(name.place,
                  "there is no signal '" + name.text + "'" + config::suggestion(name.text, table_.names()));
  return {};
}

SignalId KnownSignals::find_relation(const config::Word& text, config::Diagnostics& diagnostics) const {
  const auto expression = config::Expression::parse(text, diagnostics);
  if (!expression) return {};
  const std::size_t last = expression->nodes().size() - 1;
  if (relations_ == nullptr || !expression::is_relation(expression->nodes()[last])) {
    diagnostics.add(text.place,
                    config::in_quotes(text.text) +
                        " is no signal; a computed value is the signal of one of the 'variables'");
    return {};
  }
  const auto relation = expression::relation_of(expression->nodes(), last, &diagnostics);
  if (!relation) return {};
  add_relations(*expression);
  const SignalId signal = *table_.find(expression::relation_name(*relation));
  table_.add_alias(text.text, signal);  // by which the reader finds it during the run
  return signal;
}

bool KnownSignals::is_undeclared(std::string_view name) const {
  return std::ranges::any_of(undeclared_, [&](const auto& prefix) { return name.starts_with(prefix); });
}

std::string KnownSignals::source_of(std::string_view name) const {
  const auto signal = table_.find(name);
  if (!signal) return std::string(name);
  const std::string& own_name = table_.info(*signal).name;
  const auto source = sources_.find(own_name);
  return source == sources_.end() ? own_name : source->second;
}

units::Conversion KnownSignals::conversion_for(SignalId signal, const std::string& reader,
                                               const std::string& unit_of_reader, const config::Place& place,
                                               config::Diagnostics& diagnostics) const {
  if (!signal.valid()) return {};
  const units::ValueKind value_kind = table_.info(signal).value_kind;
  const std::string &name = table_.info(signal).name, &unit = table_.info(signal).unit;
  const auto from = units::parse_unit(unit), to = units::parse_unit(unit_of_reader);
  if (const auto found = units::signal_conversion(unit, unit_of_reader, value_kind)) {
    if (unit.empty() && to && !units::is_si(*to))
      diagnostics.warn(place,
                       units::missing_unit_text(name, *to) + "; '" + reader + "' is in " + unit_of_reader);
    if (unit_of_reader.empty() && from && !units::is_si(*from))
      diagnostics.warn(place, units::missing_unit_text(reader, *from) + "; '" + name + "' is in " + unit);
    return *found;
  }
  const auto text = [](const std::string& symbol) { return symbol.empty() ? "no unit" : symbol; };
  std::string hint;
  if (!from || !to)
    hint = "; " + config::in_quotes(!from ? unit : unit_of_reader) + " is not a known unit";
  else if (value_kind == units::ValueKind::difference && to->offset != 0.0)
    hint = "; it is a difference of temperatures";
  else if (from->dimension == to->dimension)
    hint = units::angle_hint(from->dimension, units::angle_of(*from, value_kind), to->angle);
  diagnostics.add(place, "'" + name + "' is in " + text(unit) + ", but '" + reader + "' is in " +
                             text(unit_of_reader) + hint);
  return {};
}

std::optional<double> value_named(const std::map<std::string, double>& values, const config::Word& name,
                                  const std::string& signal, config::Diagnostics& diagnostics) {
  const auto found = values.find(name.text);
  if (found != values.end() && !std::isnan(found->second)) return found->second;
  if (found != values.end()) {
    diagnostics.add(name.place,
                    "'" + signal + "' has several values with the name '" + name.text + "'; use the number");
    return std::nullopt;
  }
  std::vector<std::string> names;
  names.reserve(values.size());
  for (const auto& [known, value] : values)
    names.push_back(known);
  diagnostics.add(
      name.place,
      config::in_quotes(name.text) + " is neither a number nor a signal, and '" + signal + "' has " +
          (names.empty() ? "no value names" : "no value of that name" + config::all_known(name.text, names)));
  return std::nullopt;
}

}  // namespace hil::signals
