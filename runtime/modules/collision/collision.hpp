#pragma once
// Whether one body touches others: an overlap query of its oriented bounds at every step.
//
// Outputs  hits   bodies touched now
//          total  bodies that began to touch so far

#include "runtime/modules/module.hpp"

namespace hil::modules {

ModuleType collision_type();

}  // namespace hil::modules
