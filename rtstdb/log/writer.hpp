#pragma once
// What comes out of the ring goes to the disk: groups into segments, now and then a checkpoint. A machine without a thread of its
// own: whoever drives it calls step().
//
// A disk that fails: the group that failed is kept, and so is the watermark. After a while, which grows from time to time, a new
// segment begins with that group, and a checkpoint follows; when that is on disk the watermark moves again. A file that failed is
// neither written nor trusted any more. While there is no room on the way, the recorder tells of a gap; behind it, too, the
// watermark waits for a checkpoint. Memory that there is not is a fault as any other.
//
// Threads: one drives it; what tells how far it is, `flush_soon` and `checkpoint_soon` are anybody's.

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
  /// A checkpoint follows that many bytes of groups; 0: only where one is needed.
  std::uint64_t checkpoint_every_bytes = std::uint64_t{256} << 20;
  /// After each checkpoint, removes what lies before the older of the two newest ones (prune_log).
  bool prune = false;
  std::uint32_t rows_per_slice = 4096;
  /// Records wait that long for others; 0: they do not. A ring that is half full does not wait.
  Nanoseconds flush_interval{0};
  Nanoseconds first_retry{10'000'000};
  Nanoseconds longest_retry{1'000'000'000};
};

struct WriterStatistics {
  std::uint64_t groups = 0, bytes = 0;
  std::uint64_t segments = 0, checkpoints = 0;
  std::uint64_t pruned_segments = 0;
  Nanoseconds longest_write{0}, all_writes{0};  ///< a group's write and its sync
  std::uint64_t gaps = 0;
  std::uint64_t faults = 0;
  std::string last_fault;  ///< in words
  bool waits_for_checkpoint = false;
  std::size_t ring_high_water = 0, ring_bytes = 0;
};

class Writer {
 public:
  /// With a first segment on disk that goes on where the log ended. Refuses, as ErrorCode::file, what the disk refuses. All
  /// references outlive it.
  static Result<std::unique_ptr<Writer>> start(Disk& disk, const Clock& clock, Ring& ring,
                                               WorldSource& source, const WriterOptions& options,
                                               const LogStart& start);

  struct Step {
    bool worked = false;                   ///< there may be more at once
    ClockTime wake_at = ClockTime::max();  ///< else: not before, unless records come
    bool has_records = false;              ///< which wait for that time; more of them may wait with them
  };
  Step step(std::int64_t real_time_ns);

  /// Nobody puts records any more: writes what is there, what is needed for it to count, and the closing group. The fault where the
  /// log could not be closed; it is whole all the same, also where this throws std::bad_alloc.
  Result<void> close(std::int64_t real_time_ns);

  /// Every version up to this one is on disk, or came to nothing.
  Version durable() const noexcept { return durable_.load(std::memory_order_acquire); }
  /// Records on disk, of those that came out of the ring.
  std::uint64_t records_on_disk() const noexcept { return records_on_disk_.load(std::memory_order_acquire); }
  /// The watermark stays until there is a checkpoint of a version behind a fault or a gap.
  bool waits_for_checkpoint() const noexcept { return waits_for_checkpoint_.load(std::memory_order_acquire); }
  /// The last thing that the watermark needs could not be written; it is tried again.
  bool refused_by_disk() const noexcept { return refused_by_disk_.load(std::memory_order_acquire); }
  /// Records do not wait any longer.
  void flush_soon() noexcept { flush_soon_.store(true, std::memory_order_relaxed); }
  /// A checkpoint is made soon.
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
  /// Notes a fault of the disk; the next checkpoint retries.
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
  std::uint64_t group_number_, link_;  // of the group that comes next
  Group group_;
  ClockTime last_flush_ = ClockTime::min();
  Retry retry_;

  Checkpointer checkpointer_;
  std::uint64_t bytes_since_checkpoint_;

  Checkpointer::Synced synced_;
  std::atomic<bool> waits_for_checkpoint_;
  Version needed_version_;  // that the checkpoint has at least
  std::atomic<Version> durable_{0};
  std::atomic<std::uint64_t> records_on_disk_{0};
  std::atomic<bool> refused_by_disk_{false};
  std::atomic<bool> flush_soon_{false}, checkpoint_soon_{false};

  mutable std::mutex statistics_mutex_;
  WriterStatistics statistics_;
};

}  // namespace rtstdb::log
