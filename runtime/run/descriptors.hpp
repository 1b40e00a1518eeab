#pragma once
// Ensures before a run that there are enough file descriptors for all of it.

#include "runtime/config/scenario.hpp"

namespace hil::run {

/// Raises the soft limit of this process as far as the scenario needs and the hard limit permits. Throws
/// io::DeviceError with the limit and what to do when fewer descriptors are left than the run needs. Leaves
/// none open.
void require_descriptors(const config::Scenario& scenario);

}  // namespace hil::run
