#pragma once
// File descriptors that a run needs: a run that begins does not fail for the lack of one later.

#include "runtime/config/scenario.hpp"

namespace hil::run {

/// Raises the soft limit of this process as far as the scenario needs and the hard limit permits. Throws
/// io::DeviceError with the limit and what to do when fewer descriptors are left than the run needs. Needs
/// none that stays open.
void require_descriptors(const config::Scenario& scenario);

}  // namespace hil::run
