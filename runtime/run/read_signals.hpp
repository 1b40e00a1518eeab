#pragma once
// What a run reads of its signals.
//
// Threads: the one that opens the run.

#include <vector>

#include "runtime/run/wiring.hpp"

namespace hil::run {

/// The signals that modules, buses, expectations, stimuli and faults read, also by way of variables and of
/// faults, each once. Plots and recordings do not count, since nothing depends on them.
std::vector<signals::SignalId> signals_read_in(const Wiring& wiring);

}  // namespace hil::run
