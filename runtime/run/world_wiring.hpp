#pragma once
// The part of the wiring that is about the world: its layers and bodies by name, the scenery's shapes, and the room
// for all of them.

#include "runtime/run/wiring.hpp"

namespace hil::run {

/// Fills in the layers and the scenery. The modules are declared.
void wire_world(Wiring& wiring, config::Diagnostics& diagnostics);

}  // namespace hil::run
