#include "runtime/modules/registry.hpp"

#include <algorithm>

namespace hil::modules {

#define MODULE(folder) ModuleType folder##_type();
#include "runtime/modules/table.def"
#undef MODULE

const std::vector<ModuleType>& module_types() {
#define MODULE(folder) folder##_type(),
  static const std::vector<ModuleType> types{
#include "runtime/modules/table.def"
  };
#undef MODULE
  return types;
}

const ModuleType* find_module_type(const std::string& name) {
  const auto& types = module_types();
  const auto found =
      std::find_if(types.begin(), types.end(), [&](const ModuleType& type) { return type.name == name; });
  return found == types.end() ? nullptr : &*found;
}

}  // namespace hil::modules
