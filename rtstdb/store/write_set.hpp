#pragma once
// What one commit writes, self-contained: after Store::stage every write holds the id and the whole row that
// it leaves behind, so that a log can write the set down and apply it again without asking anything else.

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>
#include <rtstdb/time.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb::store {

enum class WriteKind : std::uint8_t { create, update, update_motion, remove };

struct Write {
  Write() = default;
  Write(WriteKind what, const EntityState& wanted) noexcept : kind(what), state(wanted) {}

  WriteKind kind = WriteKind::create;
  // After staging, of update_motion alone: what it need not have said (see store/motion_words), and the low bits of the version that
  // wrote the row before it. Here they take no room.
  std::uint16_t unchanged = 0;
  std::uint16_t follows = 0;
  /// Given: `id` (not for create) and, by kind, `row` or `row.motion`. After staging: the entity as the write
  /// leaves it, orientation normalised; for remove only `id` and `written_by` mean something.
  EntityState state;
};

/// Moves the corners of a geometry.
struct ShapeWrite {
  GeometryId geometry;
  std::size_t given = 0;  ///< positions; where there was no room for them, positions_m is empty
  std::size_t room = 0;
  std::span<const glm::vec3> positions_m;
};

struct WriteSet {
  Version version = 0;  ///< set by staging
  WorldTime time{};     ///< from when the version holds
  std::vector<Write> writes;
  std::vector<ShapeWrite> shapes{};

  bool empty() const noexcept { return writes.empty() && shapes.empty(); }
};

}  // namespace rtstdb::store
