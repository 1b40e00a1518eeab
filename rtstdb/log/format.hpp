#pragma once
// What lies where in the files of a log, format version 3. Little endian; numbers stand at multiples of their size.
//
//     lock                    empty; who writes holds it
//     segment.NNNNNNNNNN      SegmentHeader, then groups, each at a multiple of `sector_bytes`; zeros to its end;
//                             segment.NNNNNNNNNN.new until its begin is on disk
//     checkpoint.NNNNNNNNNN   CheckpointHeader, then chunks, the last of kind `end`; checkpoint.NNNNNNNNNN.new while it is written
//     geometry.NNNNNNNNNN     GeometryHeader, positions, corners
//
// A group is a GroupHeader and its payload, which is records one behind the other. Group n + 1 is written after n is on disk, and
// sectors that hold a group are not written again: a crash tears the last group alone. A group's `link` is the header checksum
// of the group before it (0: there is none).
//
// Segments are read from the newest back: the groups of one count up to the first group of a later one. So a log goes on behind a
// torn group, or a file that can not be trusted any more, without a byte of what is there being changed.
//
// Formats 1 and 2 are read as well: format 2 is this one without moves, in which no motion leaves out that it holds from the commit's
// world time on; format 1 is format 2 in which no motion leaves anything out.
//
// Every checksum is seeded with the database's id, and covers what stands before it in its struct, or the payload.

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace rtstdb::log {

static_assert(std::endian::native == std::endian::little, "structs are written as they lie in memory");

inline constexpr std::uint32_t format_version = 3;
inline constexpr std::uint32_t oldest_format = 1;
constexpr bool is_known_format(std::uint32_t format) {
  return format >= oldest_format && format <= format_version;
}
/// What a disk writes whole or not at all.
inline constexpr std::size_t sector_bytes = 512;
/// Beyond these a length is taken for damage before anything is made of it.
inline constexpr std::uint32_t max_record_bytes = 1u << 30;
inline constexpr std::uint32_t max_payload_bytes = 1u << 30;
inline constexpr std::uint32_t max_name_bytes = 4096;

using Magic = std::array<char, 8>;
inline constexpr Magic segment_magic{'R', 'T', 'S', 'T', 'L', 'O', 'G', '1'};
inline constexpr Magic checkpoint_magic{'R', 'T', 'S', 'T', 'C', 'K', 'P', '1'};
inline constexpr Magic geometry_magic{'R', 'T', 'S', 'T', 'G', 'E', 'O', '1'};
inline constexpr std::uint32_t group_magic = 0x47545352;  // "RSTG"
inline constexpr std::uint32_t chunk_magic = 0x43545352;  // "RSTC"

struct SegmentHeader {
  Magic magic = segment_magic;
  std::uint32_t format = format_version;
  /// The length in sectors that was allocated when the file was created: a shorter file was cut off. 0:
  /// nothing was allocated ahead.
  std::uint32_t allocated_sectors = 0;
  std::uint64_t database_id = 0;
  std::uint64_t number = 0;
  std::uint64_t first_group = 0;
  std::uint64_t link = 0;            ///< that its first group has
  std::uint64_t version_before = 0;  ///< the newest that a group before it has; for people
  std::uint64_t checksum = 0;
};
static_assert(sizeof(SegmentHeader) == 64 && offsetof(SegmentHeader, checksum) == 56);

/// Ended on purpose: nothing was to follow.
inline constexpr std::uint32_t closing_flag = 1;

struct GroupHeader {
  std::uint32_t magic = group_magic;
  std::uint32_t flags = 0;
  std::uint64_t number = 0;
  std::uint32_t payload_bytes = 0;
  std::uint32_t records = 0;
  std::uint64_t first_version = 0;  ///< of its commits; 0: it has none
  std::uint64_t last_version = 0;
  std::int64_t real_time_ns = 0;  ///< since 1970, for people
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
  taken_back = 3,
  gap = 4,
  move = 5,
};

struct RecordHeader {
  RecordKind kind = RecordKind::none;
  std::uint16_t left_out = 0;  ///< of a move; else 0
  std::uint32_t bytes = 0;     ///< with this header; a multiple of 8
};
static_assert(sizeof(RecordHeader) == 8);

/// Followed by the writes, then the shapes.
struct CommitBody {
  std::uint64_t version = 0;
  std::int64_t world_time_ns = 0;
  std::uint32_t writes = 0;
  std::uint32_t shapes = 0;
};
static_assert(sizeof(CommitBody) == 24);

enum class StoredWriteKind : std::uint32_t { create = 1, update = 2, update_motion = 3, remove = 4 };

/// Alone: a remove. Before what is told of a StoredMotion: update_motion. Before a StoredLook and a StoredMotion: create, update.
struct StoredWrite {
  StoredWriteKind kind = StoredWriteKind::remove;
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
  /// create and update: the geometry. update_motion: what its motion leaves out, and in the high half which row it follows. remove: 0.
  std::uint32_t what = 0;
};
static_assert(sizeof(StoredWrite) == 16);

// What is not told of a StoredMotion. Bit k, of its first fourteen: number k, since it is what it was in the row before. Then it is
// told which row that is, by the low bits of the version that wrote it, so that another one is noticed; else 0 is told.
inline constexpr std::uint16_t unchanged_words = (1u << 14) - 1;
/// The last of them: valid_from_ns.
inline constexpr std::uint16_t valid_from_word = 1u << 13;
/// Another reason to leave that one out: it is the commit's world time, and not what it was.
inline constexpr std::uint16_t holds_from_world_time = 1u << 14;
/// Of a move: the world time, since it is that of the commit before it, with no gap between them, and none taken back.
inline constexpr std::uint16_t world_time_as_before = 1u << 15;

/// A commit that moves one entity and does nothing else. Followed by the world time and what is told of a StoredMotion.
struct MoveBody {
  std::uint64_t version = 0;  ///< high 16 bits: which row the motion follows
  std::uint32_t index = 0;
  std::uint32_t generation = 0;
};
static_assert(sizeof(MoveBody) == 16);
/// A commit of a later version is never told as a move.
inline constexpr std::uint64_t max_move_version = (std::uint64_t{1} << 48) - 1;

/// A row but for its motion and its geometry.
struct StoredLook {
  double scale[3] = {};
  std::uint32_t mask = 0;
  std::uint32_t material = 0;
};
static_assert(sizeof(StoredLook) == 32);

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

/// Followed by the name, and zeros to a multiple of 8. Stands in records and in checkpoints.
struct StoredGeometry {
  std::uint64_t file = 0;           ///< geometry.NNNNNNNNNN
  std::uint64_t file_checksum = 0;  ///< of its header
  std::uint32_t index = 0;
  std::uint32_t deforms = 0;
  std::uint32_t kept_shapes = 0;
  float rebuild_growth = 0.0f;
  std::uint32_t name_bytes = 0;
  std::uint32_t reserved = 0;
};
static_assert(sizeof(StoredGeometry) == 40);

/// A version that is in the log came to nothing. It is the newest so far.
struct TakenBackBody {
  std::uint64_t version = 0;
};

/// Versions from..to were published and are not recorded.
struct GapBody {
  std::uint64_t from = 0;
  std::uint64_t to = 0;
};

// ---- checkpoint

struct CheckpointHeader {
  Magic magic = checkpoint_magic;
  std::uint32_t format = format_version;
  std::uint32_t index_limit = 0;  ///< rows and generations are told for all indices below
  std::uint64_t database_id = 0;
  std::uint64_t number = 0;
  std::uint64_t version = 0;
  std::int64_t world_time_ns = 0;
  std::uint64_t next_version = 0;
  // Where records newer than the version begin.
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
  rows = 2,   ///< StoredIndex each, and behind it the row where one lives; indices go on from chunk to chunk
  shape = 3,  ///< the version that made it (64 bits), then a StoredShape with its positions
  end = 4,    ///< empty
};

struct ChunkHeader {
  std::uint32_t magic = chunk_magic;
  ChunkKind kind = ChunkKind::end;
  std::uint64_t number = 0;  ///< from 0 on
  std::uint64_t checkpoint = 0;
  std::uint32_t payload_bytes = 0;
  std::uint32_t entries = 0;  ///< indices of a chunk of rows; else 1, and 0 at the end
  std::uint64_t payload_checksum = 0;
  std::uint64_t checksum = 0;
};
static_assert(sizeof(ChunkHeader) == 48 && offsetof(ChunkHeader, checksum) == 40);

/// What an index is at the checkpoint's version. Where an entity lives a StoredLook and a StoredMotion follow.
struct StoredIndex {
  std::uint32_t generation = 0;  ///< the last that was given
  std::uint32_t lives = 0;
  std::uint64_t written_by = 0;  ///< where it lives, as the next
  std::uint32_t geometry = 0;
  std::uint32_t reserved = 0;
};
static_assert(sizeof(StoredIndex) == 24);

// ---- geometry

struct GeometryHeader {
  Magic magic = geometry_magic;
  std::uint32_t format = format_version;
  std::uint32_t reserved = 0;
  std::uint64_t database_id = 0;
  std::uint64_t number = 0;
  std::uint32_t positions = 0;
  std::uint32_t triangles = 0;
  std::uint64_t payload_checksum = 0;
  std::uint64_t checksum = 0;
};
static_assert(sizeof(GeometryHeader) == 56 && offsetof(GeometryHeader, checksum) == 48);

constexpr std::size_t round_up(std::size_t bytes, std::size_t unit) {
  return (bytes + unit - 1) / unit * unit;
}

}  // namespace rtstdb::log
