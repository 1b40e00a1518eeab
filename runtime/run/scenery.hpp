#pragma once
// The bodies that a scenario lists under world.entities: geometry made or read, entities created, outlines
// for the report.

#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/modules/world.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::run {

/// Throws modules::SetupError.
void create_scenery(const config::Scenario& scenario, modules::World& world);

/// Outlines of the scenery from above.
std::vector<report::Shape> outlines(const config::Scenario& scenario);

}  // namespace hil::run
