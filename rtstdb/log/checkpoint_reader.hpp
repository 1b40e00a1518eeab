#pragma once
// A checkpoint read back, whole or not at all.

#include <cstdint>
#include <optional>
#include <vector>

#include <rtstdb/result.hpp>

#include "rtstdb/log/directory.hpp"
#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/format.hpp"
#include "rtstdb/log/position.hpp"
#include "rtstdb/log/world.hpp"

namespace rtstdb::log {

struct Checkpoint {
  CheckpointHeader header;
  World world;  ///< its geometries have no meshes yet
  Position position() const noexcept { return {header.segment, header.offset, header.group, header.link}; }
};

/// The header alone. Refused: one that is damaged, or of a format that is not known.
Result<CheckpointHeader> read_checkpoint_header(Disk& disk, std::uint64_t number);

/// Refused, with the file, the offset and what was found: anything that is not as it was written.
Result<Checkpoint> read_checkpoint(Disk& disk, std::uint64_t number, std::uint64_t database_id);

/// That is whole, of a version from `not_before` on; none: there is none.
std::optional<Checkpoint> oldest_checkpoint(Disk& disk, const Listing& listing, Version not_before);

/// Gives the geometries of a checkpoint's world their meshes, and holds its shapes to them.
Result<void> read_meshes(Disk& disk, std::uint64_t database_id, World& world);

}  // namespace rtstdb::log
