#pragma once
// The key `plugins` of a scenario. Plug-ins are loaded while its files are read, since settings of parameters
// need the schemas of their modules.
//
// Threads: one.

#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/config/scenario.hpp"
#include "runtime/contract/tree.hpp"

namespace hil::config {

/// The most plug-ins of a scenario.
inline constexpr std::size_t max_plugins = 64;

Schema plugins_schema();

/// The types of a scenario, to which its plug-ins are added as they are found.
struct TypesWithPlugins {
  explicit TypesWithPlugins(const ScenarioTypes& of_program) : types(of_program) {}

  ScenarioTypes types;  ///< with the modules of plug-ins
  std::vector<plugins::PluginIdentity> plugins{};

  /// Loads the plug-ins that the document names, each once. Adds a mistake for each one that can not be
  /// loaded.
  void add_plugins(const TreeNode& document, Diagnostics& diagnostics);
  /// The first entry that add_plugins has not seen, since an override made it; null: none.
  const TreeNode* entry_of_override(const TreeNode& document) const;

 private:
  std::vector<Place> added_;  ///< of entries
};

}  // namespace hil::config
