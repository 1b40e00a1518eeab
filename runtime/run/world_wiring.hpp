#pragma once
// The wiring of the world: the names of its layers and bodies, the shapes of the scenery, and the
// database's capacity for all of them.

#include "runtime/run/wiring.hpp"

namespace hil::run {

/// Fills in the layers and the scenery. The modules have been created.
void wire_world(Wiring& wiring, config::Diagnostics& diagnostics);

}  // namespace hil::run
