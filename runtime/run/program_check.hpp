#pragma once
// Whether the programs that a scenario starts are there.
//
// Threads: the one that loads the scenario.

#include <filesystem>
#include <span>

#include <hil/diagnostics.hpp>

#include "runtime/config/scenario.hpp"

namespace hil::run {

/// A mistake for each process whose program is a path without an executable file, from the folder of the
/// scenario; a warning for each whose program is a name that is neither in a folder of `search_folders` nor
/// in PATH. Processes that the run does not start do not count.
void check_programs(const config::Scenario& scenario, std::span<const std::filesystem::path> search_folders,
                    config::Diagnostics& diagnostics);

}  // namespace hil::run
