#pragma once
// Ensures before a run that it can open enough file descriptors.

#include "runtime/config/scenario.hpp"

namespace hil::run {

/// Raises the soft limit of this process as far as the scenario needs and the hard limit permits. Throws
/// io::DeviceError with the limit and what to do when the run needs more descriptors than are left. Leaves
/// none open.
void require_descriptors(const config::Scenario& scenario);

}  // namespace hil::run
