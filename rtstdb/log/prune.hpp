#pragma once
// Removes the files of a log that no recovery needs. Two checkpoints stay, so that the log opens even when
// the newer one is damaged.

#include <cstdint>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

/// Removes all checkpoints but the two newest, then the segments before the one at which recovery from the
/// older of the two begins. Returns the number of removed segments. Removes nothing unless both newest
/// checkpoints have valid headers. At every moment, also after a crash during the call, the directory is a
/// log that opens. Geometry files stay.
DiskResult<std::uint64_t> prune_log(Disk& disk);

}  // namespace rtstdb::log
