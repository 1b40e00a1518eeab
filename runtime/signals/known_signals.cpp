#include "runtime/signals/known_signals.hpp"

#include <algorithm>
#include <cmath>

namespace hil::signals {

SignalId KnownSignals::find(const config::Word& name, config::Diagnostics& diagnostics) const {
  if (const auto found = table_.find(name.text)) {
    const auto imprecise = imprecise_.find(found->index);
    if (imprecise != imprecise_.end())
      diagnostics.warn(name.place, "'" + name.text + "' " + imprecise->second);
    return *found;
  }
  if (is_undeclared(name.text)) return {};
  diagnostics.add(name.place,
                  "there is no signal '" + name.text + "'" + config::suggestion(name.text, table_.names()));
  return {};
}

bool KnownSignals::is_undeclared(std::string_view name) const {
  return std::ranges::any_of(undeclared_, [&](const auto& prefix) { return name.starts_with(prefix); });
}

void KnownSignals::check_unit(SignalId signal, const std::string& reader, const std::string& unit_of_reader,
                              const config::Place& place, config::Diagnostics& diagnostics) const {
  if (!signal.valid()) return;
  const auto spelled = [](std::string unit) {
    unit.erase(std::remove(unit.begin(), unit.end(), '^'), unit.end());
    return unit;
  };
  const std::string& unit = table_.info(signal).unit;
  if (unit.empty() || unit_of_reader.empty() || spelled(unit) == spelled(unit_of_reader)) return;
  diagnostics.add(place, "'" + table_.info(signal).name + "' is in " + unit + ", but '" + reader +
                             "' is in " + unit_of_reader);
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
  diagnostics.add(name.place,
                  config::in_quotes(name.text) + " is neither a number nor a signal, and '" + signal +
                      "' has " +
                      (names.empty() ? "no value names"
                                     : "no value of that name" + config::suggestion(name.text, names)));
  return std::nullopt;
}

}  // namespace hil::signals
