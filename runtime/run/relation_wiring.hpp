#pragma once
// The task that computes the relations of bodies (expression/relation.hpp): the one of the scenario whose
// module type computes them, or else one that is added, at the end of each tick.
//
// Threads: the one that wires the run.

#include <string>

#include "runtime/run/wiring.hpp"
#include "runtime/signals/known_signals.hpp"

namespace hil::run {

/// The name of the task's module.
std::string relations_module(const config::Scenario& scenario);

/// Makes the module for the relations that the expressions of the run read: in the task of the scenario,
/// whose module is null so far, or in a task that is added to the scenario and to the wiring if there are
/// relations. The scenario has capacity for one more task. Adds the mistakes of the relations.
void wire_relations(config::Scenario& scenario, const signals::RelationSignals& relations, Wiring& wiring,
                    config::Diagnostics& diagnostics);

}  // namespace hil::run
