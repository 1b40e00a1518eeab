#pragma once
// The sections of a scenario, one reader each. For the files of this folder; scenario.hpp is the public side.

#include "runtime/config/reading.hpp"

namespace hil::config {

void read_general(const Value& root, Scenario& scenario, ReaderContext& reading);
void read_world(const Value& root, Scenario& scenario, ReaderContext& reading);
/// A variable whose expression can not be parsed stays among the others, without it.
void read_variables(const Value& root, Scenario& scenario, ReaderContext& reading);
void read_tasks(const Value& root, Scenario& scenario, ReaderContext& reading);
/// The lists of all bus types. After read_general.
void read_buses(const Value& root, Scenario& scenario, ReaderContext& reading);
/// After read_buses, whose names it looks up.
void read_processes(const Value& root, Scenario& scenario, ReaderContext& reading);
/// Adds to the stimuli, the faults and the expectations.
void read_test_tables(const Value& root, Scenario& scenario, ReaderContext& reading);
void read_recording(const Value& root, Scenario& scenario, ReaderContext& reading);
/// After read_general.
void read_plots(const Value& root, Scenario& scenario, ReaderContext& reading);

}  // namespace hil::config
