#pragma once
// Reads checkpoints. A checkpoint is read completely or refused.

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
  World world;  ///< without the meshes of its geometries, see read_meshes
  Position position() const noexcept { return {header.segment, header.offset, header.group, header.link}; }
};

/// Reads the header only. Errors: file, for a damaged header or another format.
Result<CheckpointHeader> read_checkpoint_header(Disk& disk, std::uint64_t number);

/// Errors: file, with the file, the offset and the fault, for any damage.
Result<Checkpoint> read_checkpoint(Disk& disk, std::uint64_t number, std::uint64_t database_id);

/// The oldest undamaged checkpoint whose version is at least `not_before`; none: there is none.
std::optional<Checkpoint> oldest_checkpoint(Disk& disk, const Listing& listing, Version not_before);

/// Reads the meshes of a checkpoint's geometries and checks the shapes against them.
Result<void> read_meshes(Disk& disk, std::uint64_t database_id, World& world);

}  // namespace rtstdb::log
