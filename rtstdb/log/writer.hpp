#pragma once
// Writes records from the ring to disk: groups into segments, and checkpoints from time to time. A state
// machine without a thread of its own: the caller calls step() repeatedly.
//
// Disk failures: the group that failed is kept, and the durable version does not advance. After a waiting
// time, which grows with each failure, a new segment begins with that group and a checkpoint follows; when
// the checkpoint is on disk, the durable version advances again. A file with a failed write is neither
// written nor trusted any more. If the ring becomes full by then, the recorder records a gap; after a gap,
// too, the durable version advances only with a checkpoint. Memory exhaustion is handled as a disk failure.
//
// Threads: one thread drives it; any thread may call the functions that report progress, flush_soon and
// checkpoint_soon.

#include <atomic>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include <rtstdb/result.hpp>
#include <rtstdb/time.hpp>

#include "rtstdb/log/checkpointer.hpp"
#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/group.hpp"
#include "rtstdb/log/log_start.hpp"
#include "rtstdb/log/retry.hpp"
#include "rtstdb/log/ring.hpp"
#include "rtstdb/log/segment_file.hpp"
#include "rtstdb/log/world_source.hpp"

namespace rtstdb::log {

struct WriterOptions {
  std::uint64_t segment_bytes = std::uint64_t{64} << 20;
  /// Bytes of groups after which a checkpoint is made; 0: only when one is needed.
  std::uint64_t checkpoint_every_bytes = std::uint64_t{256} << 20;
  /// After each checkpoint, removes the files before the older of the two newest checkpoints (prune_log).
  bool prune = false;
  std::uint32_t rows_per_slice = 4096;
  /// How long records wait for others to form a group; 0: not at all. They do not wait if the ring is half
  /// full.
  Nanoseconds flush_interval{0};
  Nanoseconds first_retry{10'000'000};
  Nanoseconds longest_retry{1'000'000'000};
};

struct WriterStatistics {
  std::uint64_t groups = 0, bytes = 0;
  std::uint64_t segments = 0, checkpoints = 0;
  std::uint64_t pruned_segments = 0;
  Nanoseconds longest_write{0}, all_writes{0};  ///< time to write and sync a group: largest, sum
  std::uint64_t gaps = 0;
  std::uint64_t faults = 0;
  std::string last_fault;  ///< a sentence
  bool waits_for_checkpoint = false;
  std::size_t ring_high_water = 0, ring_bytes = 0;
};

class Writer {
 public:
  /// Creates a writer with a first segment on disk that continues the log. Errors: file, for disk failures.
  /// All references must outlive the writer.
  static Result<std::unique_ptr<Writer>> start(Disk& disk, const Clock& clock, Ring& ring,
                                               WorldSource& source, const WriterOptions& options,
                                               const LogStart& start);

  struct Step {
    bool worked = false;                   ///< call step again at once
    ClockTime wake_at = ClockTime::max();  ///< otherwise: call it at this time, or when new records arrive
    bool has_records = false;  ///< records are waiting for that time, and new ones may wait with them
  };
  Step step(std::int64_t real_time_ns);

  /// Writes the remaining records, a checkpoint if one is needed, and the closing group. No more records may
  /// be put into the ring. Errors: file, if the log could not be closed; the log is undamaged all the same,
  /// also if std::bad_alloc is thrown.
  Result<void> close(std::int64_t real_time_ns);

  /// Every published version up to this one is on disk.
  Version durable() const noexcept { return durable_.load(std::memory_order_acquire); }
  /// Number of records from the ring that are on disk.
  std::uint64_t records_on_disk() const noexcept { return records_on_disk_.load(std::memory_order_acquire); }
  /// The durable version does not advance before a checkpoint of a version after the failure or gap.
  bool waits_for_checkpoint() const noexcept { return waits_for_checkpoint_.load(std::memory_order_acquire); }
  /// The last write failed and is retried.
  bool last_write_failed() const noexcept { return last_write_failed_.load(std::memory_order_acquire); }
  /// Requests that waiting records be written now.
  void flush_soon() noexcept { flush_soon_.store(true, std::memory_order_relaxed); }
  /// Requests a checkpoint.
  void checkpoint_soon() noexcept { checkpoint_soon_.store(true, std::memory_order_relaxed); }
  WriterStatistics statistics() const;

 private:
  Writer(Disk& disk, const Clock& clock, Ring& ring, WorldSource& source, const WriterOptions& options,
         const LogStart& start);

  DiskFault open_segment(std::span<const std::byte> first_groups = {});
  DiskFault begin(const LogStart& start);
  void gather() noexcept;
  bool group_is_due(ClockTime now) noexcept;
  DiskFault write_group(std::int64_t real_time_ns);
  DiskFault write_group_or_throw(std::int64_t real_time_ns);
  void group_is_on_disk(std::size_t bytes, Nanoseconds took);
  void segment_failed(const DiskError& fault, ClockTime now);
  bool step_checkpoint(ClockTime now, std::int64_t real_time_ns);
  bool checkpoint_is_due(ClockTime now) const noexcept;
  void checkpoint_is_on_disk(Version version);
  /// Notes a disk failure; the next checkpoint retries.
  void prune();
  void note_fault(const DiskError& fault);
  void move_watermark() noexcept;
  ClockTime wake_at() const noexcept;

  Disk& disk_;
  const Clock& clock_;
  Ring& ring_;
  WriterOptions options_;
  std::uint64_t database_id_;

  std::unique_ptr<SegmentFile> segment_;
  std::uint64_t next_segment_;
  std::uint64_t group_number_, link_;  // of the next group
  Group group_;
  ClockTime last_flush_ = ClockTime::min();
  Retry retry_;

  Checkpointer checkpointer_;
  std::uint64_t bytes_since_checkpoint_;

  Checkpointer::Synced synced_;
  std::atomic<bool> waits_for_checkpoint_;
  Version needed_version_;  // smallest version of a checkpoint that waits_for_checkpoint_ accepts
  std::atomic<Version> durable_{0};
  std::atomic<std::uint64_t> records_on_disk_{0};
  std::atomic<bool> last_write_failed_{false};
  std::atomic<bool> flush_soon_{false}, checkpoint_soon_{false};

  mutable std::mutex statistics_mutex_;
  WriterStatistics statistics_;
};

}  // namespace rtstdb::log
