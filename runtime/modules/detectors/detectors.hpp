#pragma once
// Detector loops in the road: each counts the bodies over it, by a region query at every step.
//
// Outputs  <loop>  bodies over the loop now

#include "runtime/modules/module.hpp"

namespace hil::modules {

ModuleType detectors_type();

}  // namespace hil::modules
