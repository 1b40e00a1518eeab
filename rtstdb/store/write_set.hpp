#pragma once
// The writes of one commit. After Store::stage the set is self-contained: each write holds the id and the
// whole row that it leaves, so that a log can record the set and apply it again.

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
  // Set by staging, for update_motion only: the words of the motion that the write leaves unchanged
  // (motion_words.hpp), and the low 16 bits of the version that wrote the row before. They fit into the
  // padding.
  std::uint16_t unchanged = 0;
  std::uint16_t base_version_low = 0;
  /// Before staging: `id` (not for create) and, depending on the kind, `row` or `row.motion`. After staging:
  /// the entity as this write leaves it, with a normalised orientation; for remove, only `id` and
  /// `written_by` are meaningful.
  EntityState state;
};

/// Replaces the positions of a deforming geometry.
struct ShapeWrite {
  GeometryId geometry;
  std::size_t given = 0;  ///< number of positions; if it exceeds `room`, positions_m is empty
  std::size_t space = 0;  ///< number of positions that the transaction had room for
  std::span<const glm::vec3> positions_m;
};

struct WriteSet {
  Version version = 0;  ///< set by staging
  WorldTime time{};     ///< the version covers world time from here on
  std::vector<Write> writes;
  std::vector<ShapeWrite> shapes{};

  bool empty() const noexcept { return writes.empty() && shapes.empty(); }
};

}  // namespace rtstdb::store
