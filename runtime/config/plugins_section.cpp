#include "runtime/config/plugins_section.hpp"

#include <algorithm>

#include <hil/require.hpp>

namespace hil::config {

Schema plugins_schema() {
  return Schema::list(Schema::text(), 0, max_plugins);
}

void TypesWithPlugins::add_plugins(const TreeNode& document, Diagnostics& diagnostics) {
  const TreeNode* const list = document.find("plugins");
  if (list == nullptr) return;
  for (const TreeNode& entry : list->items) {
    const Place place = entry.place();
    if (std::ranges::find(added_, place) != added_.end()) continue;
    if (added_.size() == max_plugins) return;  // the schema refuses the list
    added_.push_back(place);
    if (entry.scalar.empty()) continue;  // the schema refuses it
    require(types.load_plugin != nullptr, "a scenario with plug-ins needs a function that loads them");
    std::string fault;
    auto loaded = types.load_plugin(entry.scalar, entry.source->directory(), fault);
    if (!loaded) {
      diagnostics.add(place, fault);
      continue;
    }
    if (std::ranges::find(plugins, loaded->plugin.path, &plugins::PluginIdentity::path) != plugins.end())
      continue;
    plugins.push_back(std::move(loaded->plugin));
    types.modules.merge(loaded->modules);
  }
}

const TreeNode* TypesWithPlugins::entry_of_override(const TreeNode& document) const {
  const TreeNode* const list = document.find("plugins");
  if (list == nullptr) return nullptr;
  for (const TreeNode& entry : list->items)
    if (std::ranges::find(added_, entry.place()) == added_.end()) return &entry;
  return nullptr;
}

}  // namespace hil::config
