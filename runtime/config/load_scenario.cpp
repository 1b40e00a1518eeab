#include <filesystem>
#include <memory>
#include <system_error>

#include "runtime/config/overrides.hpp"
#include "runtime/config/scenario_parts.hpp"

namespace hil::config {

std::optional<Scenario> load_scenario(const std::string& path, std::span<const std::string> overrides,
                                      const SchemaOfModules& modules, Diagnostics& diagnostics) {
  const std::size_t mistakes_before = diagnostics.count();
  const std::shared_ptr<const SourceText> source = read_source(path, diagnostics);
  if (!source) return std::nullopt;
  std::optional<TreeNode> tree = build_tree(source, diagnostics);
  if (!tree) return std::nullopt;
  const Schema schema = scenario_schema();
  apply_overrides(*tree, schema, overrides, diagnostics);
  const std::optional<Value> root = check_tree(*tree, schema, diagnostics);
  if (!root) return std::nullopt;

  Scenario scenario;
  std::error_code error;
  scenario.file = std::filesystem::absolute(path, error).lexically_normal().string();
  Reading reading{diagnostics, modules, std::nullopt, {}, {}};
  read_general(*root, scenario, reading);
  read_world(*root, scenario, reading);
  read_tasks(*root, scenario, reading);
  read_can(*root, scenario, reading);
  read_modbus(*root, scenario, reading);
  read_processes(*root, scenario, reading);
  read_expectations(*root, scenario, reading);
  if (diagnostics.count() != mistakes_before) return std::nullopt;
  return scenario;
}

}  // namespace hil::config
