#pragma once
// A mesh in a file of its own, on disk before the record that names it. Setup; any thread, one at a time.

#include <cstdint>

#include <rtstdb/geometry.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

/// Writes the file, which is not there yet, and returns its checksum for the record. What was begun before a fault is removed
/// where that can be done.
DiskResult<std::uint64_t> write_geometry_file(Disk& disk, std::uint64_t database_id, std::uint64_t number,
                                              const TriangleMesh& mesh);

/// Refuses a file that is gone or not as it was written, with the file and what was found, and one that the disk does not read now
/// (then `unreadable` is set, where it is given: nothing is known of what is in it); ErrorCode::file.
Result<TriangleMesh> read_geometry_file(Disk& disk, std::uint64_t database_id, std::uint64_t number,
                                        std::uint64_t file_checksum, bool* unreadable = nullptr);

}  // namespace rtstdb::log
