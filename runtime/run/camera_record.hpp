#pragma once
// The part of a run's record on its cameras.
//
// Threads: after the last tick.

#include <span>

#include "runtime/contribution/contribution.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/camera_files.hpp"

namespace hil::run {

/// Fills in record.cameras, and adds sentences on missing files to record.failures and on files beyond the
/// limit to record.realtime.degraded. `files`: of those cameras that write any.
void add_cameras(std::span<const contribution::Camera> cameras, std::span<const CameraFileRecord> files,
                 report::RunRecord& record);

}  // namespace hil::run
