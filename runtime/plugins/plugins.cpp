#include "runtime/plugins/plugins.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <system_error>

#include <hil/plugin.hpp>

#include "runtime/modules/registry.hpp"

namespace hil::plugins {
namespace {

namespace fs = std::filesystem;

std::vector<LoadedPlugin>& loaded_plugins() {
  static std::vector<LoadedPlugin> plugins;
  return plugins;
}

/// Why the types can not be added, as a clause; empty: they can.
std::string fault_of(const std::vector<modules::ModuleType>& types) {
  if (types.empty()) return "it has no module types";
  for (std::size_t i = 0; i < types.size(); ++i) {
    const std::string& name = types[i].name;
    if (name.empty() || types[i].create == nullptr) return "a module type has no name or no 'create'";
    if (modules::find_module_type(name) != nullptr) {
      const std::string owner = plugin_of(name);
      return "the module type '" + name + "' is one of " + (owner.empty() ? "hil" : "plug-in " + owner);
    }
    for (std::size_t k = 0; k < i; ++k)
      if (types[k].name == name) return "it has two module types '" + name + "'";
  }
  return {};
}

}  // namespace

std::vector<fs::path> plugin_folders() {
  std::vector<fs::path> folders;
  if (const char* const list = std::getenv("HIL_PLUGIN_PATH")) {
    const std::string_view text(list);
    for (std::size_t begin = 0; begin <= text.size();) {
      const std::size_t end = std::min(text.find(':', begin), text.size());
      if (end > begin) folders.emplace_back(text.substr(begin, end - begin));
      begin = end + 1;
    }
  }
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error).parent_path();
  folders.push_back(program.parent_path() / "plugins");
  folders.push_back(program.parent_path() / "lib/hil/plugins");
  return folders;
}

std::optional<fs::path> find_plugin(const std::string& name, const fs::path& scenario_folder,
                                    std::string& fault) {
  std::error_code error;
  if (name.find('/') != std::string::npos) {
    const fs::path path = (scenario_folder / name).lexically_normal();
    if (fs::exists(path, error)) return path;
    fault = "there is no plug-in " + path.string();
    return std::nullopt;
  }
  std::string folders;
  for (const fs::path& folder : plugin_folders()) {
    const fs::path path = folder / (name + ".so");
    if (fs::exists(path, error)) return fs::absolute(path, error).lexically_normal();
    folders += (folders.empty() ? "" : ", ") + folder.string();
  }
  fault = "there is no plug-in '" + name + "' (" + name + ".so) in " + folders +
          "; set HIL_PLUGIN_PATH to its folder";
  return std::nullopt;
}

std::optional<LoadedPlugin> load_plugin(const fs::path& path, std::string& fault) {
  std::error_code error;
  const fs::path file = fs::canonical(path, error);
  for (const LoadedPlugin& plugin : loaded_plugins())
    if (!error && plugin.identity.path == file) return plugin;
  auto read = read_plugin(error ? path : file, fault);
  if (!read) return std::nullopt;
  const auto refuse = [&](const std::string& why) -> std::optional<LoadedPlugin> {
    fault = path.string() + " can not be loaded: " + why;
    return std::nullopt;
  };
  void* const library = ::dlopen(read->path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return refuse(::dlerror());
  const auto entry = reinterpret_cast<Entry>(::dlsym(library, entry_name));
  if (entry == nullptr) return refuse(std::string("it has no function ") + entry_name);
  LoadedPlugin plugin{.identity = std::move(*read), .types = {}};
  try {
    const std::vector<modules::ModuleType>& types = entry();
    if (const std::string why = fault_of(types); !why.empty()) return refuse(why);
    for (const modules::ModuleType& type : types)
      plugin.types.push_back(type.name);
    loaded_plugins().push_back(plugin);
    modules::add_module_types(types);
  } catch (const std::exception& thrown) {
    return refuse(std::string("its module types can not be made: ") + thrown.what());
  }
  return plugin;
}

std::string plugin_of(const std::string& module_type) {
  for (const LoadedPlugin& plugin : loaded_plugins())
    if (std::ranges::find(plugin.types, module_type) != plugin.types.end()) return plugin.identity.name;
  return {};
}

}  // namespace hil::plugins
