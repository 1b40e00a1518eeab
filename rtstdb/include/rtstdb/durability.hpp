#pragma once
// What survives the end of the process, and of the power: a log of commits in a directory, with a checkpoint of the whole world now
// and then. A database that is opened with the directory goes on from the world that it tells of.
//
// What is promised, by mode:
//
//   mode           outcome given               a version can be read   lost when the process dies, or the power goes
//   volatile_only  when published              when published          all
//   async          when published              when published          what is not on disk: where that keeps up, the commits of the
//                                                                      last flush_interval and of the write under way
//   group          when on disk, with all      when published          nothing that was given as durable
//                  that came meanwhile
//   sync           when on disk                when on disk            nothing that could be read
//
// What is recovered is always the world as it was after one of its versions, whole; all that came before that version is in it.
// A deadline is about publishing; in sync mode about the disk too.
//
// When the disk does not do its part, the loop goes first:
//   it is slow    Commits wait in a ring in memory. When that is full: async goes on without recording (a gap; the log is whole again
//                 with the next checkpoint); group and sync refuse writes (RefusedBy::log_full).
//   it refuses    Tried again, in a new file, until it is done; async goes on meanwhile. Group gives back what waits, as done and not
//                 durable, and refuses writes (RefusedBy::log_fault) until the disk takes them again; sync refuses.
// Database::durability() says which of these has happened. Segments are allocated ahead; where the disk has
// no space for that, a segment grows with each write, so that a log opens on a nearly full disk.
//
// The files of the directory, and which of them may be deleted while no process has the log open:
//
//   lock                     empty; may be deleted
//   segment.N, checkpoint.N  the log; must not be deleted by hand: DurabilityOptions::prune removes those
//                            that no recovery needs
//   geometry.N               the meshes that the log refers to; must not be deleted
//   *.new                    unfinished files; may be deleted, and the next open deletes them
//   checkpoint.N.abandoned   a checkpoint that a salvage set aside; never read, may be deleted
//
// The whole directory may be deleted. Its files may be copied elsewhere, all together. inspect_log (log.hpp)
// verifies them.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include <rtstdb/time.hpp>
#include <rtstdb/transaction.hpp>

namespace rtstdb {

enum class DurabilityMode : std::uint8_t { volatile_only, async, group, sync };
const char* to_string(DurabilityMode mode) noexcept;

struct DurabilityOptions {
  /// Where the log is; made when it is not there, its parent must be. Empty: nothing is written down, whatever else stands here but
  /// for the modes group and sync, which are refused; and volatile_only is with a directory.
  std::filesystem::path directory{};
  DurabilityMode mode = DurabilityMode::async;
  /// Async: commits wait that long for others to be written with them. 0 to max_option_duration_ns.
  Nanoseconds flush_interval{10'000'000};
  /// What commits wait in for the disk. A commit takes about 200 bytes a row and 12 a position of a shape, and at most half of it.
  /// min_ring_bytes to max_ring_bytes; as much again is taken for what is being written.
  std::size_t ring_bytes = std::size_t{16} << 20;
  /// The log's files are that long, allocated ahead. min_segment_bytes and more.
  std::uint64_t segment_bytes = std::uint64_t{16} << 20;
  /// A checkpoint follows so many bytes of log: what an open has to read at most. It takes a copy of the world. 0: only where one is
  /// needed.
  std::uint64_t checkpoint_every_bytes = std::uint64_t{256} << 20;
  /// After each checkpoint the writer removes all checkpoints but the two newest, and the segments that only
  /// the removed ones need. The directory then stops growing, and a history begins with the older of the two
  /// checkpoints (HistoryExtent::first). Geometry files stay. Off: a history begins with the empty world.
  bool prune = false;
  /// A damaged log is opened up to the version before the damage; else it is refused. Checkpoints that are newer and not whole stay as
  /// checkpoint.N.abandoned: from here on nobody reads them. What the disk does not read is refused all the same.
  bool salvage = false;
};

inline constexpr std::size_t min_ring_bytes = std::size_t{4} << 10;
inline constexpr std::size_t max_ring_bytes = std::size_t{1} << 30;
inline constexpr std::uint64_t min_segment_bytes = std::uint64_t{4} << 10;

/// What an open found in the directory.
struct Recovery {
  /// False: there was no database yet, or the database has no directory.
  bool found = false;
  Version version = 0;        ///< that the world is at
  Version checkpoint = 0;     ///< where reading began; 0: with the empty world
  std::uint64_t commits = 0;  ///< read from the log behind that
  bool closed = false;        ///< the log was ended on purpose
  bool torn = false;          ///< what was being written last was cut off
  bool salvaged = false;      ///< something behind `version` was damaged, and is lost
  Nanoseconds duration{0};
  std::string in_words{};  ///< a sentence: what was found, what was cut and why
};

/// How the log is, now.
struct Durability {
  DurabilityMode mode = DurabilityMode::volatile_only;
  std::uint64_t database_id = 0;  ///< drawn when the directory was new, and in each of its files
  /// Every version up to this one is on disk, or came to nothing.
  Version durable = 0;
  /// The disk refused what was written last; it is tried again.
  bool refused_by_disk = false;
  /// `durable` stays until there is a checkpoint, which is being made.
  bool waits_for_checkpoint = false;
  std::uint64_t faults = 0;  ///< calls that the disk refused
  std::string last_fault{};  ///< in words; empty: none
  std::uint64_t gaps = 0;    ///< told of in the log
  std::uint64_t commits_in_gaps = 0;
  std::size_t ring_bytes = 0, ring_high_water = 0;
  std::uint64_t groups = 0, bytes = 0;  ///< written and on disk
  std::uint64_t segments = 0, checkpoints = 0;
  std::uint64_t pruned_segments = 0;            ///< see DurabilityOptions::prune
  Nanoseconds longest_write{0}, all_writes{0};  ///< of a group, until it was on disk
};

}  // namespace rtstdb
