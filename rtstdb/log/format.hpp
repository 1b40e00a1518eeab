#pragma once
// The layout of the files of a log. Little endian; each number is at a multiple of its size.
//
//     lock                    empty; locked by the writing process
//     segment.NNNNNNNNNN      SegmentHeader, then groups, each at a multiple of `sector_bytes`, then zeros.
//                             Its name is segment.NNNNNNNNNN.new until its beginning is on disk
//     checkpoint.NNNNNNNNNN   CheckpointHeader, then chunks, the last of kind `end`. Its name is
//                             checkpoint.NNNNNNNNNN.new while it is written
//     geometry.NNNNNNNNNN     GeometryHeader, positions, triangles, convex parts, corner values
//
// A group is a GroupHeader and its payload, a sequence of records. Group n + 1 is written after group n is on
// disk, and a sector that holds a group is never written again: a crash damages only the last group. The
// `link` of a group is the header checksum of the group before it (0: there is none).
//
// A later segment may begin with a group number that an earlier segment has too; then the later one is valid.
// So a log continues after a torn group, or after a file with a failed write, without a change of the
// existing bytes.
//
// A log of another format is refused. A new format gets the next number, so that the numbers of older logs
// stay unique: 1 and 2 were earlier encodings of motions; in 3, a material is a bare number; in 4, geometries
// have no solids. What an older program does not know, such as lights, can be added within a format if logs
// without it keep their bytes and an older program refuses logs with it.
//
// Each checksum is seeded with the database's id. A header's checksum covers the members before it; a payload
// checksum covers the payload.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <string>

#include <rtstdb/limits.hpp>

namespace rtstdb::log {

static_assert(std::endian::native == std::endian::little, "structs are written as they lie in memory");

inline constexpr std::uint32_t format_version = 5;
/// A disk writes this many bytes whole or not at all.
inline constexpr std::size_t sector_bytes = 512;
/// A larger length in a file is damage, and is rejected before memory is allocated for it.
inline constexpr std::uint32_t max_record_bytes = 1u << 30;
inline constexpr std::uint32_t max_payload_bytes = 1u << 30;
inline constexpr std::uint32_t max_name_bytes = 4096;
inline constexpr std::uint32_t max_definition_properties = 4096;

using Magic = std::array<char, 8>;
inline constexpr Magic segment_magic{'R', 'T', 'S', 'T', 'L', 'O', 'G', '1'};
inline constexpr Magic checkpoint_magic{'R', 'T', 'S', 'T', 'C', 'K', 'P', '1'};
inline constexpr Magic geometry_magic{'R', 'T', 'S', 'T', 'G', 'E', 'O', '1'};
inline constexpr std::uint32_t group_magic = 0x47545352;  // "RSTG"
inline constexpr std::uint32_t chunk_magic = 0x43545352;  // "RSTC"

struct SegmentHeader {
  Magic magic = segment_magic;
  std::uint32_t format = format_version;
  /// Length in sectors that was allocated when the file was created: a shorter file was truncated. 0: nothing
  /// was allocated ahead.
  std::uint32_t allocated_sectors = 0;
  std::uint64_t database_id = 0;
  std::uint64_t number = 0;
  std::uint64_t first_group = 0;
  std::uint64_t link = 0;            ///< of its first group
  std::uint64_t version_before = 0;  ///< newest version in the groups before it; informative
  std::uint64_t checksum = 0;
};
static_assert(sizeof(SegmentHeader) == 64 && offsetof(SegmentHeader, checksum) == 56);

/// GroupHeader::flags of the last group of a log that was closed. The group has no records.
inline constexpr std::uint32_t closing_flag = 1;

struct GroupHeader {
  std::uint32_t magic = group_magic;
  std::uint32_t flags = 0;
  std::uint64_t number = 0;
  std::uint32_t payload_bytes = 0;
  std::uint32_t records = 0;
  std::uint64_t first_version = 0;  ///< of its commits; 0: it has no commits
  std::uint64_t last_version = 0;
  std::int64_t real_time_ns = 0;  ///< since 1970; informative
  std::uint64_t link = 0;
  std::uint64_t payload_checksum = 0;
  std::uint64_t checksum = 0;
};
static_assert(sizeof(GroupHeader) == 72 && offsetof(GroupHeader, checksum) == 64);

// ---- records

enum class RecordKind : std::uint16_t {
  none = 0,
  commit = 1,
  geometry = 2,
  discarded = 3,
  gap = 4,
  move = 5,
  material = 6,
  light = 7,
};

struct RecordHeader {
  RecordKind kind = RecordKind::none;
  std::uint16_t omitted_words = 0;  ///< move: omitted words; otherwise 0
  std::uint32_t bytes = 0;          ///< length with this header; a multiple of 8
};
static_assert(sizeof(RecordHeader) == 8);

/// Body of a commit record. Followed by the writes, then by the shapes.
struct CommitBody {
  std::uint64_t version = 0;
  std::int64_t world_time_ns = 0;
  std::uint32_t writes = 0;
  std::uint32_t shapes = 0;
};
static_assert(sizeof(CommitBody) == 24);

enum class StoredWriteKind : std::uint32_t { create = 1, update = 2, update_motion = 3, remove = 4 };

/// Followed by: nothing (remove); a StoredMotion without its omitted words (update_motion); a
/// StoredAppearance and a StoredMotion (create, update).
struct StoredWrite {
  StoredWriteKind kind = StoredWriteKind::remove;
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
  /// create and update: the geometry. update_motion: the omitted words, and in the high half the low 16 bits
  /// of the version that wrote the row before. remove: 0.
  std::uint32_t what = 0;
};
static_assert(sizeof(StoredWrite) == 16);

// Omitted words of a StoredMotion. Bit k of the first fourteen: word k is omitted, because it equals that of
// the row before. If any such bit is set, the record holds the low 16 bits of the version that wrote that
// row, so that a wrong base row is detected; otherwise these bits are 0.
inline constexpr std::uint16_t unchanged_words = (1u << 14) - 1;
/// The last of the fourteen: valid_from_ns.
inline constexpr std::uint16_t valid_from_word = 1u << 13;
/// valid_from_ns is omitted because it equals the commit's world time (and not that of the row before).
inline constexpr std::uint16_t valid_from_is_world_time = 1u << 14;
/// Move: the world time is omitted because it equals that of the previous commit. Between the two, there is
/// neither a gap nor a discarded version.
inline constexpr std::uint16_t same_world_time = 1u << 15;

/// Body of a move record: a commit that consists of one update_motion. Followed by the world time, unless
/// omitted, and a StoredMotion without its omitted words.
struct MoveBody {
  std::uint64_t version = 0;  ///< high 16 bits: low 16 bits of the version that wrote the row before
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
};
static_assert(sizeof(MoveBody) == 16);
/// A commit of a later version is never written as a move record.
inline constexpr std::uint64_t max_move_version = (std::uint64_t{1} << 48) - 1;

/// A row without its motion and its geometry.
struct StoredAppearance {
  double scale[3] = {};
  std::uint32_t mask = 0;
  std::uint16_t material = 0;
  std::uint16_t light = 0;  ///< index of the light plus 1; 0: none
};
static_assert(sizeof(StoredAppearance) == 32);
static_assert(max_materials <= 1u << 16 && max_lights < 1u << 16);

struct StoredMotion {
  double p_world_m[3] = {};
  double q_world[4] = {};  ///< w, x, y, z
  double v_world_mps[3] = {};
  double w_world_radps[3] = {};
  std::int64_t valid_from_ns = 0;
};
static_assert(sizeof(StoredMotion) == 112);

/// Followed by the positions, three floats each, and zeros to a multiple of 8.
struct StoredShape {
  std::uint32_t geometry = 0;
  std::uint32_t positions = 0;
};
static_assert(sizeof(StoredShape) == 8);

/// In records and checkpoints. Followed by the name, and zeros to a multiple of 8.
struct StoredGeometry {
  std::uint64_t file = 0;           ///< geometry.NNNNNNNNNN
  std::uint64_t file_checksum = 0;  ///< checksum of the file's header
  std::uint32_t index = 0;
  std::uint32_t deforms = 0;
  std::uint32_t retained_shapes = 0;
  float rebuild_growth = 0.0f;
  std::uint32_t name_bytes = 0;
  std::uint32_t reserved = 0;
};
static_assert(sizeof(StoredGeometry) == 40);

/// A material or a light, in records and checkpoints. Followed by the properties by ascending number
/// (stored_definition.cpp), then by the name, and zeros to a multiple of 8. The default material is not
/// recorded.
struct StoredDefinition {
  std::uint32_t index = 0;
  std::uint32_t properties = 0;
  std::uint32_t name_bytes = 0;
  std::uint32_t kind = 0;  ///< light: 1 directional, 2 point, 3 spot, 4 sky; material: 0
};
static_assert(sizeof(StoredDefinition) == 16);

/// A property with its default value is left out. So a new property changes neither the format nor the bytes
/// of definitions that do not have it; a reader that does not know a property refuses the log.
struct StoredProperty {
  std::uint32_t property = 0;  ///< its number
  std::uint32_t reserved = 0;
  double value = 0.0;
};
static_assert(sizeof(StoredProperty) == 16);

/// The version, the newest in the log so far, was discarded after it had been recorded.
struct DiscardBody {
  std::uint64_t version = 0;
};

/// Versions `from` to `to` were published and are not in the log.
struct GapBody {
  std::uint64_t from = 0;
  std::uint64_t to = 0;
};

// ---- checkpoint

struct CheckpointHeader {
  Magic magic = checkpoint_magic;
  std::uint32_t format = format_version;
  std::uint32_t index_limit = 0;  ///< the checkpoint has a StoredIndex for each index below this
  std::uint64_t database_id = 0;
  std::uint64_t number = 0;
  std::uint64_t version = 0;
  std::int64_t world_time_ns = 0;
  std::uint64_t next_version = 0;
  // Position of the first group after the checkpoint's version.
  std::uint64_t segment = 0;
  std::uint64_t offset = 0;
  std::uint64_t group = 0;
  std::uint64_t link = 0;
  std::int64_t real_time_ns = 0;
  std::uint64_t checksum = 0;
};
static_assert(sizeof(CheckpointHeader) == 104 && offsetof(CheckpointHeader, checksum) == 96);

enum class ChunkKind : std::uint32_t {
  geometry = 1,  ///< one StoredGeometry with its name
  rows = 2,      ///< a StoredIndex for each index, followed by the row of a living entity
  shape = 3,     ///< the version that made the shape (64 bits), then a StoredShape with its positions
  end = 4,       ///< empty
  material = 5,  ///< one StoredDefinition with its properties and its name; so is light
  light = 6,
};

struct ChunkHeader {
  std::uint32_t magic = chunk_magic;
  ChunkKind kind = ChunkKind::end;
  std::uint64_t number = 0;  ///< 0, 1, ... within the checkpoint
  std::uint64_t checkpoint = 0;
  std::uint32_t payload_bytes = 0;
  std::uint32_t entries = 0;  ///< rows: number of indices; end: 0; otherwise 1
  std::uint64_t payload_checksum = 0;
  std::uint64_t checksum = 0;
};
static_assert(sizeof(ChunkHeader) == 48 && offsetof(ChunkHeader, checksum) == 40);

/// State of an index in the checkpoint's version. If an entity lives there, a StoredAppearance and a
/// StoredMotion follow.
struct StoredIndex {
  std::uint32_t generation = 0;  ///< the last generation of the index
  std::uint32_t lives = 0;       ///< 1: an entity lives there
  std::uint64_t written_by = 0;  ///< 0 if no entity lives there; so is geometry
  std::uint32_t geometry = 0;
  std::uint32_t reserved = 0;
};
static_assert(sizeof(StoredIndex) == 24);

// ---- geometry

/// GeometryOptions::solid.
struct StoredSolid {
  double size_m[3]{};
  double radius_m = 0.0, height_m = 0.0;
  double center_m[3]{};
  double q_entity_wxyz[4]{};
};
static_assert(sizeof(StoredSolid) == 96);

// GeometryHeader::corner_values. An older program of this format refuses a file that has any for its length.
inline constexpr std::uint32_t has_corner_normals = 1;
inline constexpr std::uint32_t has_corner_colors = 2;

/// Followed by the positions, the triangles and the points of the convex parts: for each part their number,
/// then three floats each. Then the corner normals and the corner colours, if there are any: for each
/// triangle three times three floats.
struct GeometryHeader {
  Magic magic = geometry_magic;
  std::uint32_t format = format_version;
  std::uint32_t convex_parts = 0;
  std::uint64_t database_id = 0;
  std::uint64_t number = 0;
  std::uint32_t positions = 0;
  std::uint32_t triangles = 0;
  std::uint32_t solid_kind = 0;  ///< 0: none, else SolidKind plus 1
  std::uint32_t corner_values = 0;
  StoredSolid solid;
  std::uint64_t payload_checksum = 0;
  std::uint64_t checksum = 0;
};
static_assert(sizeof(GeometryHeader) == 160 && offsetof(GeometryHeader, solid_kind) == 40 &&
              offsetof(GeometryHeader, checksum) == 152);

/// Why a file with this format number is refused.
inline std::string refused_format(std::uint32_t format) {
  return "it has log format " + std::to_string(format) + ", and this version of rtstdb reads format " +
         std::to_string(format_version) + " only; open it with the version that wrote it";
}

constexpr std::size_t round_up(std::size_t bytes, std::size_t unit) {
  return (bytes + unit - 1) / unit * unit;
}

}  // namespace rtstdb::log
