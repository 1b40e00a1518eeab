#pragma once
// Makes checkpoints, one at a time, in slices: begins, continues and abandons them, and retries after a
// failure.
//
// Threads: the log thread.

#include <cstdint>
#include <memory>
#include <optional>

#include <rtstdb/time.hpp>

#include "rtstdb/log/checkpoint_file.hpp"
#include "rtstdb/log/retry.hpp"

namespace rtstdb::log {

class Checkpointer {
 public:
  Checkpointer(Disk& disk, WorldSource& source, std::uint64_t database_id, std::uint64_t next_number,
               std::uint32_t rows_per_slice, const Retry& retry)
      : disk_(disk),
        source_(source),
        database_id_(database_id),
        next_number_(next_number),
        rows_per_slice_(rows_per_slice),
        retry_(retry) {}
  Checkpointer(const Checkpointer&) = delete;
  Checkpointer& operator=(const Checkpointer&) = delete;
  ~Checkpointer() { abandon(); }

  bool in_progress() const noexcept { return file_ != nullptr; }
  bool may_begin(ClockTime now) const noexcept { return !in_progress() && now >= retry_.at(); }
  ClockTime retry_at() const noexcept { return retry_.at(); }
  /// Resets the waiting time after failures.
  void try_now() noexcept { retry_.succeeded(); }

  /// abandoned: the version of the checkpoint is no longer kept; the next checkpoint starts with a newer one.
  enum class Progress : std::uint8_t { nothing, something, finished, abandoned, failed };
  struct Step {
    Progress progress = Progress::nothing;
    Version version = 0;  ///< finished: version of the checkpoint
    DiskFault fault;      ///< failed: the reason
  };
  /// Requests a checkpoint. `position`: position of the next group; `not_before`: the newest version, not
  /// discarded, of the records taken from the ring. If the source is not ready, the values of the first call
  /// remain valid. abandoned: the version of the source is older.
  Step begin(const Position& position, Version not_before, ClockTime now, std::int64_t real_time_ns);
  /// What is on disk.
  struct Synced {
    Version version = 0;
    AddedCounts added{};
  };
  /// Writes the next slice. Publishes the checkpoint when all versions up to its own, its geometries, its
  /// materials and its lights are on disk.
  Step advance(const Synced& synced, ClockTime now);
  void abandon() noexcept;

 private:
  Step begin_file(ClockTime now, std::int64_t real_time_ns);
  Step advance_writing(const Synced& synced, ClockTime now);
  Step failed(const DiskError& fault, ClockTime now);

  Disk& disk_;
  WorldSource& source_;
  std::uint64_t database_id_;
  std::uint64_t next_number_;
  std::uint32_t rows_per_slice_;
  Retry retry_;
  struct Request {
    Position position;
    Version not_before = 0;
  };
  std::optional<Request> request_;
  bool source_has_begun_ = false;
  std::unique_ptr<CheckpointFile> file_;
  bool written_ = false;
};

}  // namespace rtstdb::log
