#include "runtime/modules/module.hpp"

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

}  // namespace hil::modules
