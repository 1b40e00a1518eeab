#pragma once
// The module types of the plug-in docking.

#include <hil/module.hpp>

namespace hil::modules {

ModuleType docking_port_type();
ModuleType pixel_study_type();

}  // namespace hil::modules
