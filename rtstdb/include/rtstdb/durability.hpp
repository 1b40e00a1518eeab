#pragma once
// Durability: a write-ahead log in a directory, with a checkpoint of the whole world from time to time. A
// database that is opened with the directory recovers the world from it.
//
// Guarantees by mode:
//
//   mode           the outcome is given   a version is readable   a crash or a power loss loses
//   volatile_only  at publication         at publication          everything
//   async          at publication         at publication          the commits that are not on disk: when the
//                                                                 disk keeps up, those of the last
//                                                                 flush_interval and of the write in progress
//   group          when it is on disk     at publication          no transaction whose outcome says `durable`
//   sync           when it is on disk     when it is on disk      no version that was readable
//
// In group mode the commits that arrive during a write are written together by the next one.
//
// Recovery restores the world as it was after one version, with all earlier versions included. A deadline
// applies to publication; in sync mode publication happens on disk.
//
// When the disk does not keep up or fails, the loop has precedence:
//   slow     Commits wait in a ring in memory. When the ring is full, async continues without recording; the
//            missing versions are a gap, and the log is complete again from the next checkpoint on. Group and
//            sync refuse writes (RefusedBy::log_full).
//   failing  The writer retries in a new file until it succeeds. Async continues. Group ends the
//            waiting transactions as committed and not durable; group and sync refuse further writes
//            (RefusedBy::log_fault) until the disk accepts them again.
// Database::durability() reports both. Segments are allocated ahead; if the disk has no space for that, a
// segment grows with each write, so that a log opens on a nearly full disk.
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
  /// The log's directory. It is created if it does not exist; its parent must exist. Empty: no log. Then the
  /// modes group and sync are refused. With a directory, volatile_only is refused.
  std::filesystem::path directory{};
  DurabilityMode mode = DurabilityMode::async;
  /// Async: how long a commit waits for others, to be written with them. 0 to max_option_duration_ns.
  Nanoseconds flush_interval{10'000'000};
  /// Size of the ring in which commits wait for the disk. A commit takes about 200 bytes for each row and 12
  /// for each position of a shape; a commit larger than half of the ring is refused (group, sync) or becomes
  /// a gap (async). The writer needs the same amount of memory again. min_ring_bytes to max_ring_bytes.
  std::size_t ring_bytes = std::size_t{16} << 20;
  /// Size of a segment, which is allocated ahead. At least min_segment_bytes.
  std::uint64_t segment_bytes = std::uint64_t{16} << 20;
  /// Bytes of log after which a checkpoint is written: bounds what open has to read. A checkpoint needs a
  /// copy of the world in memory. 0: a checkpoint is written only after a gap or a failed write.
  std::uint64_t checkpoint_every_bytes = std::uint64_t{256} << 20;
  /// After each checkpoint the writer removes all checkpoints but the two newest, and the segments that only
  /// the removed ones need. The directory then stops growing, and a history begins with the older of the two
  /// checkpoints (HistoryExtent::first). Geometry files stay. Off: a history begins with the empty world.
  bool prune = false;
  /// Opens a damaged log at the version before the damage, instead of refusing it. Newer checkpoints that are
  /// damaged are renamed to checkpoint.N.abandoned and never read again. A read error of the disk is refused
  /// all the same.
  bool salvage = false;
};

inline constexpr std::size_t min_ring_bytes = std::size_t{4} << 10;
inline constexpr std::size_t max_ring_bytes = std::size_t{1} << 30;
inline constexpr std::uint64_t min_segment_bytes = std::uint64_t{4} << 10;

/// What open found in the log's directory.
struct Recovery {
  /// False: there was no database yet, or the database has no directory.
  bool found = false;
  Version version = 0;        ///< the latest version of the recovered world
  Version checkpoint = 0;     ///< version of the checkpoint that recovery started from; 0: the empty world
  std::uint64_t commits = 0;  ///< read from the log after the checkpoint
  bool closed = false;        ///< the log was closed by close()
  bool torn = false;          ///< the last write was incomplete and was cut off
  bool salvaged = false;      ///< data after `version` was damaged and is lost
  Nanoseconds duration{0};
  std::string summary{};  ///< a sentence on what was found, what was cut off and why
};

/// The present state of the log. Counts are since open.
struct Durability {
  DurabilityMode mode = DurabilityMode::volatile_only;
  std::uint64_t database_id = 0;  ///< random, drawn when the log was created; each of its files holds it
  /// Every published version up to this one is on disk.
  Version durable = 0;
  /// The last write failed; the writer retries.
  bool last_write_failed = false;
  /// `durable` does not advance until a checkpoint, which is in progress, is on disk.
  bool waits_for_checkpoint = false;
  std::uint64_t faults = 0;  ///< file operations that failed
  std::string last_fault{};  ///< a sentence on the last of them; empty: none
  std::uint64_t gaps = 0;    ///< recorded in the log
  std::uint64_t commits_in_gaps = 0;
  std::size_t ring_bytes = 0, ring_high_water = 0;
  std::uint64_t groups = 0, bytes = 0;  ///< written and on disk
  std::uint64_t segments = 0, checkpoints = 0;
  std::uint64_t pruned_segments = 0;            ///< see DurabilityOptions::prune
  Nanoseconds longest_write{0}, all_writes{0};  ///< time to bring a group to disk: largest, sum
};

}  // namespace rtstdb
