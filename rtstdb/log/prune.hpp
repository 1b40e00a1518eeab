#pragma once
// Removes what a recovery does not need any more. Two checkpoints stay, so that the log opens also where the newer one is damaged.

#include <cstdint>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

/// Removes all checkpoints but the two newest, then the segments before the one from which the older of these two is read on. Returns
/// how many segments. Removes nothing where there are no two checkpoints with whole headers. At any moment, also of a crash within,
/// the directory is a log that opens. Geometry files stay.
DiskResult<std::uint64_t> prune_log(Disk& disk);

}  // namespace rtstdb::log
