#include "runtime/modules/block/block_names.hpp"

#include <algorithm>
#include <utility>

#include "runtime/config/expression.hpp"

namespace hil::modules {

void BlockNames::declare(const std::string& what, const std::string& name, const config::Place& place,
                         config::Diagnostics& diagnostics) {
  if (config::is_reserved_word(name)) {
    diagnostics.add(
        place, "'" + name + "' is a word of the expression language; give the " + what + " another name");
    return;
  }
  const auto is_named = [&](const expression::Function& function) { return function.name == name; };
  if (what == "table" && std::ranges::any_of(expression::functions(), is_named)) {
    diagnostics.add(place, "'" + name + "' is a function; give the table another name");
    return;
  }
  const auto [first, is_new] = declared_.emplace(name, Declared{what, place.line});
  if (is_new) return;
  diagnostics.add(place, "the " + first->second.what + " in line " + std::to_string(first->second.line) +
                             " is also called '" + name + "'; the names of a block are unique");
}

void BlockNames::define(const std::string& name, std::uint32_t value, std::string unit,
                        const std::map<std::string, double>& named_values, bool accepts_any_name,
                        units::ValueKind value_kind) {
  const std::map<std::string, double>* names = nullptr;
  if (!named_values.empty()) names = &named_values_.emplace_back(named_values);
  defined_[name] = {.index = value,
                    .unit = std::move(unit),
                    .named_values = names,
                    .accepts_any_name = accepts_any_name,
                    .value_kind = value_kind};
}

const expression::Variable* BlockNames::defined(std::string_view name) const {
  const auto found = defined_.find(name);
  return found == defined_.end() ? nullptr : &found->second;
}

std::optional<expression::Variable> BlockNames::find(std::string_view name) const {
  const expression::Variable* const variable = defined(name);
  if (variable != nullptr) used_.emplace(name);
  return variable == nullptr ? std::nullopt : std::optional(*variable);
}

std::vector<std::string> BlockNames::names() const {
  std::vector<std::string> names;
  for (const auto& [name, variable] : defined_)
    names.push_back(name);
  return names;
}

const expression::Table* BlockNames::find_table(std::string_view name) const {
  const auto found = tables_.find(name);
  if (found != tables_.end()) used_.emplace(name);
  return found == tables_.end() ? nullptr : found->second;
}

std::vector<std::string> BlockNames::table_names() const {
  std::vector<std::string> names;
  for (const auto& [name, table] : tables_)
    names.push_back(name);
  return names;
}

}  // namespace hil::modules
