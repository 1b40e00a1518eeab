#include "runtime/modules/collision/collision.hpp"
#include "runtime/modules/detectors/detectors.hpp"
#include "runtime/modules/laser_scanner/laser_scanner.hpp"
#include "runtime/modules/module.hpp"
#include "runtime/modules/vehicles/vehicles.hpp"

namespace hil::modules {

const std::vector<ModuleType>& module_types() {
  static const std::vector<ModuleType> types{collision_type(), detectors_type(), laser_scanner_type(),
                                             vehicles_type()};
  return types;
}

}  // namespace hil::modules
