#pragma once
// Files with one mesh each. A mesh is on disk before the record that refers to it. Setup; any thread, one at
// a time.

#include <cstdint>

#include <rtstdb/geometry.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/record.hpp"

namespace rtstdb::log {

/// Writes a new file and returns the checksum of its header for the record. After a fault, the file is
/// removed if possible.
DiskResult<std::uint64_t> write_geometry_file(Disk& disk, std::uint64_t database_id, std::uint64_t number,
                                              const TriangleMesh& mesh, const GeometryOptions& options = {});

/// Errors: file, with the name and the fault, for a missing or damaged file and for a read error.
/// `unreadable`, if not null, is set for a read error, which does not mean that the file is damaged.
Result<StoredMesh> read_geometry_file(Disk& disk, std::uint64_t database_id, std::uint64_t number,
                                      std::uint64_t file_checksum, bool* unreadable = nullptr);

}  // namespace rtstdb::log
