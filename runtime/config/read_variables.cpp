#include "runtime/config/section_readers.hpp"

namespace hil::config {

void read_variables(const Value& root, Scenario& scenario, ReaderContext& reading) {
  const Value* const map = part_of(root, "variables");
  if (map == nullptr) return;
  for (std::size_t i = 0; i < map->entries().size(); ++i) {
    const auto& [name, value] = map->entries()[i];
    VariableSection variable{{name, map->key_place(i)}, std::nullopt, std::nullopt};
    if (is_whole(value)) {
      variable.expression = Expression::parse(value["value"], reading.diagnostics);
      if (value.has("unit")) variable.unit = word_of(value["unit"]);
    }
    scenario.variables.push_back(std::move(variable));
  }
}

}  // namespace hil::config
