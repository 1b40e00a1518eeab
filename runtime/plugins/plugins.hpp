#pragma once
// The plug-ins of this process: finds them, loads them, and adds their module types to those of the program
// (runtime/modules/registry.hpp). None is ever unloaded.
//
// A name without '/' is that of the file <name>.so in one of plugin_folders(); one with '/' is a path,
// relative to the folder of the scenario.
//
// Threads: one, before a run.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "runtime/plugins/plugin_file.hpp"

namespace hil::plugins {

/// HIL_PLUGIN_PATH (folders with ':' between them), then `plugins` beside the folder of this program, then
/// `lib/hil/plugins` beside it. Folders that do not exist are in the list too.
std::vector<std::filesystem::path> plugin_folders();

/// The file of that name; empty with a sentence in `fault`: there is none.
std::optional<std::filesystem::path> find_plugin(const std::string& name,
                                                 const std::filesystem::path& scenario_folder,
                                                 std::string& fault);

/// Loads the file, unless it is loaded already, and adds its module types. Empty with a sentence in `fault`:
/// it is no plug-in, has another ABI, lacks a symbol, or one of its types has a name that is taken.
/// `types`: the names of its module types.
struct LoadedPlugin {
  PluginIdentity identity;
  std::vector<std::string> types;
};
std::optional<LoadedPlugin> load_plugin(const std::filesystem::path& path, std::string& fault);

/// The name of the plug-in that has the module type; empty: it is one of the program.
std::string plugin_of(const std::string& module_type);

}  // namespace hil::plugins
