#pragma once
// The views of a scenario (world.views): images of the world at the end of a run, for its report.
//
// Threads: setup, and after the last tick; allocates, blocks and writes files.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include <hil/world/world.hpp>
#include <rtstdb/database.hpp>

#include "runtime/config/scenario.hpp"
#include "runtime/modules/recorded_camera.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::run {

/// In the order of the scenario, whose modules have created their bodies.
std::vector<modules::RecordedCamera> cameras_of_views(const config::World& scenario,
                                                      const modules::World& world);

/// Draws the views of the latest version at a run time into record.views, and as images/view-<name>.png into
/// the folder of the run. Returns a sentence for each that could not be drawn or written. `stop`: null, or
/// ends the drawing when it becomes true.
std::vector<std::string> draw_views(std::span<const modules::RecordedCamera> views,
                                    rtstdb::Database& database, std::int64_t time_ns,
                                    const std::filesystem::path& run_folder, const std::atomic<bool>* stop,
                                    report::RunRecord& record);

}  // namespace hil::run
