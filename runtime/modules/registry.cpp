#include "runtime/modules/registry.hpp"

#include <algorithm>

#include <hil/require.hpp>

namespace hil::modules {

#define MODULE(folder) ModuleType folder##_type();
#include "runtime/modules/table.def"
#undef MODULE

namespace {

std::deque<ModuleType>& all_types() {
#define MODULE(folder) folder##_type(),
  static std::deque<ModuleType> types{
#include "runtime/modules/table.def"
  };
#undef MODULE
  return types;
}

}  // namespace

const std::deque<ModuleType>& module_types() {
  return all_types();
}

void add_module_types(const std::vector<ModuleType>& types) {
  for (const ModuleType& type : types) {
    config::require(find_module_type(type.name) == nullptr, "module types have different names");
    all_types().push_back(type);
  }
}

const ModuleType* find_module_type(const std::string& name) {
  const auto& types = module_types();
  const auto found =
      std::find_if(types.begin(), types.end(), [&](const ModuleType& type) { return type.name == name; });
  return found == types.end() ? nullptr : &*found;
}

}  // namespace hil::modules
