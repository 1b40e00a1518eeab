#pragma once
// Checkpoints, one at a time, a slice at a time: begins them, goes on with them, gives them up and tries again later.
//
// Threads: the log's.

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
  ~Checkpointer() { give_up(); }

  bool under_way() const noexcept { return file_ != nullptr; }
  bool may_begin(ClockTime now) const noexcept { return !under_way() && now >= retry_.at(); }
  ClockTime retry_at() const noexcept { return retry_.at(); }
  /// As if none had failed.
  void try_now() noexcept { retry_.succeeded(); }

  /// Given up: its version was not kept, and the next one begins with a newer one.
  enum class Did : std::uint8_t { nothing, something, finished, given_up, failed };
  struct Step {
    Did did = Did::nothing;
    Version version = 0;  ///< finished: of the checkpoint
    DiskFault fault;      ///< failed
  };
  /// The group that comes next lies at `position`; `not_before` is the newest version that stands of all that were taken from
  /// the ring. Where the source takes its time, both are those of the first call. Given up: what it has is older.
  Step begin(const Position& position, Version not_before, ClockTime now, std::int64_t real_time_ns);
  /// What the log has on disk.
  struct Synced {
    Version version = 0;
    std::size_t geometries = 0;
  };
  /// Publishes once that is all versions up to its own, and its geometries.
  Step go_on(const Synced& synced, ClockTime now);
  void give_up() noexcept;

 private:
  Step begin_file(ClockTime now, std::int64_t real_time_ns);
  Step go_on_writing(const Synced& synced, ClockTime now);
  Step failed(const DiskError& fault, ClockTime now);

  Disk& disk_;
  WorldSource& source_;
  std::uint64_t database_id_;
  std::uint64_t next_number_;
  std::uint32_t rows_per_slice_;
  Retry retry_;
  struct Asked {
    Position position;
    Version not_before = 0;
  };
  std::optional<Asked> asked_;
  bool source_has_begun_ = false;
  std::unique_ptr<CheckpointFile> file_;
  bool written_ = false;
};

}  // namespace rtstdb::log
