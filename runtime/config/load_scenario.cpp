#include <filesystem>
#include <memory>
#include <system_error>
#include <utility>

#include "runtime/config/include.hpp"
#include "runtime/config/overrides.hpp"
#include "runtime/config/plugins_section.hpp"
#include "runtime/config/section_readers.hpp"

namespace hil::config {
namespace {

/// Whether all parts but the expectations and plots, which no other part refers to, are free of mistakes.
bool is_sound_without_expectations_and_plots(TreeNode tree, const Schema& schema) {
  std::erase_if(tree.entries, [](const TreeEntry& entry) {
    return entry.key.scalar == "expectations" || entry.key.scalar == "plots";
  });
  Diagnostics mistakes;
  check_tree(tree, schema, mistakes);
  return mistakes.empty();
}

}  // namespace

std::optional<Scenario> load_scenario_to_wire(const std::string& path, std::span<const std::string> overrides,
                                              const ScenarioTypes& of_program, Diagnostics& diagnostics) {
  const std::size_t mistakes_before = diagnostics.count();
  TypesWithPlugins with_plugins(of_program);
  const ScenarioTypes& types = with_plugins.types;
  const std::shared_ptr<const SourceText> source = read_source(path, diagnostics);
  if (!source) return std::nullopt;
  const Schema schema = scenario_schema(types);
  std::optional<TreeNode> tree = build_tree_with_includes(path, source, schema, with_plugins, diagnostics);
  if (!tree) return std::nullopt;
  apply_overrides(*tree, schema, overrides, types, diagnostics);
  bool sound = diagnostics.count() == mistakes_before;
  for (const char* const key : {"include", "set", "add"}) {
    // All are applied before the overrides.
    if (const TreeNode* late = tree->find(key))
      diagnostics.add(late->place(), std::string("'") + key + "' can not be set on the command line");
  }
  if (const TreeNode* late = with_plugins.entry_of_override(*tree))
    diagnostics.add(late->place(), "'plugins' can not be set on the command line");
  const std::optional<Value> root = check_tree(*tree, schema, diagnostics);
  if (!root) return std::nullopt;
  if (diagnostics.count() != mistakes_before)
    sound = sound && is_sound_without_expectations_and_plots(std::move(*tree), schema);

  Scenario scenario;
  std::error_code error;
  scenario.file = std::filesystem::absolute(path, error).lexically_normal().string();
  ReaderContext reading{.diagnostics = diagnostics, .types = types};
  const std::size_t mistakes_of_schema = diagnostics.count();
  scenario.plugins = std::move(with_plugins.plugins);
  read_general(*root, scenario, reading);
  read_world(*root, scenario, reading);
  read_tasks(*root, scenario, reading);
  read_buses(*root, scenario, reading);
  read_processes(*root, scenario, reading);
  read_stimuli(*root, scenario, reading);
  read_faults(*root, scenario, reading);
  read_test_tables(*root, scenario, reading);
  read_recording(*root, scenario, reading);
  sound = sound && diagnostics.count() == mistakes_of_schema;
  read_variables(*root, scenario, reading);
  read_expectations(*root, scenario, reading);
  read_plots(*root, scenario, reading);
  if (!sound) return std::nullopt;
  return scenario;
}

std::optional<Scenario> load_scenario(const std::string& path, std::span<const std::string> overrides,
                                      const ScenarioTypes& types, Diagnostics& diagnostics) {
  const std::size_t mistakes_before = diagnostics.count();
  std::optional<Scenario> scenario = load_scenario_to_wire(path, overrides, types, diagnostics);
  if (diagnostics.count() != mistakes_before) return std::nullopt;
  return scenario;
}

}  // namespace hil::config
