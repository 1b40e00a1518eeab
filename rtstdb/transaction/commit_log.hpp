#pragma once
// The engine's side of the log: recovers the world, records commits into a ring, and owns the thread that
// brings them to the disk and gives back what waits for that.
//
//   async   record -> ring                     the thread writes each flush_interval or half a ring
//   group   record -> ring, hold               the thread writes, then gives back what is on disk
//   sync    record -> ring, the engine waits   the thread writes, and wakes the engine
//
// Threads: open, restore and start are setup. The functions of the engine thread neither allocate nor take a
// lock nor, except in sync mode, wait.

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include <rtstdb/durability.hpp>
#include <rtstdb/result.hpp>

#include "rtstdb/log/disk.hpp"
#include "rtstdb/log/recorder.hpp"
#include "rtstdb/log/recovery.hpp"
#include "rtstdb/log/ring.hpp"
#include "rtstdb/log/writer.hpp"
#include "rtstdb/store/store.hpp"
#include "rtstdb/transaction/held_transactions.hpp"
#include "rtstdb/transaction/log_wake_up.hpp"
#include "rtstdb/transaction/monotonic_clock.hpp"
#include "rtstdb/transaction/world_copy.hpp"

namespace rtstdb::transaction {

class TransactionImpl;

/// What the log calls on the engine, from the log's thread.
class LogOwner : public JobTaker {
 public:
  /// Gives back a transaction that was held; its outcome says whether it is durable.
  virtual void return_held(TransactionImpl& transaction) noexcept = 0;
  /// The ring has space again: the engine thread should call end_gap_if_possible().
  virtual void end_gap_soon() noexcept = 0;
};

/// Replaces the log's thread in a simulation, which decides when the log works.
class LogDriver {
 public:
  virtual ~LogDriver() = default;
  /// The engine waits for the log: calls CommitLog::work at least once.
  virtual void log_is_waited_for() noexcept = 0;
};

struct CommitLogOptions {
  DurabilityOptions durability;  ///< all but the directory and volatile_only
  std::uint32_t max_entities = 4096;
  std::uint32_t max_geometries = 1024;
  /// The clock of the log's own intervals, not of deadlines; null: CLOCK_MONOTONIC.
  const Clock* clock = nullptr;
  /// Null: the log has a thread of its own. It outlives the log.
  LogDriver* driver = nullptr;
};

class CommitLog {
 public:
  /// Locks the directory, recovers the world and writes a first segment. Errors: file, capacity; see
  /// Database::open.
  static Result<std::unique_ptr<CommitLog>> open(std::shared_ptr<log::Disk> disk,
                                                 const CommitLogOptions& options);
  CommitLog(const CommitLog&) = delete;
  CommitLog& operator=(const CommitLog&) = delete;
  /// Closes.
  ~CommitLog();

  DurabilityMode mode() const noexcept { return options_.durability.mode; }
  const Recovery& recovery() const noexcept { return recovery_; }
  /// The recovered world. Before restore.
  const log::World& recovered_world() const noexcept { return recovered_->world; }

  // ---- setup
  /// Moves the recovered world into the store.
  void restore(store::Store& store);
  /// Starts the thread, if there is no driver. Owner and clock, which deadlines refer to, outlive it.
  void start(LogOwner& owner, const Clock& deadline_clock);
  /// Writes the mesh to a file of its own and syncs it. One thread at a time.
  Result<log::LoggedGeometry> write_geometry(const TriangleMesh& mesh, std::string_view name,
                                             const GeometryOptions& options);
  /// After the last commit: writes what is recorded, ends the log, gives back what is held and ends the
  /// thread. A second call returns the same.
  Result<void> close() noexcept;

  // ---- the engine thread
  /// Group and sync mode: why these writes can not become durable now; none: they can.
  std::optional<RefusedBy> refuses(const store::WriteSet& set) const noexcept;
  /// Async and group mode: records a published set. In async mode the log's thread may see it only after
  /// hand_over.
  void record(const store::WriteSet& set) noexcept;
  /// Shows the log's thread all that is recorded. To be called before the engine waits for anything.
  void hand_over() noexcept;
  /// Group mode: the transaction is done and has its status in its outcome. It is given back when its version
  /// is on disk, or when the disk refuses.
  void hold(TransactionImpl& transaction) noexcept;
  /// Sync mode: records a staged set and waits until it is on disk. False: the disk refuses.
  bool write_through(const store::WriteSet& set) noexcept;
  /// Sync mode: records that the version, which was recorded last, does not count, and waits until that is on
  /// disk. False: the disk refuses.
  bool take_back(Version version) noexcept;
  /// Ends a gap of the log when there is space again. To be called regularly.
  void end_gap_if_possible() noexcept;
  /// Whether the ring has space for record_geometry.
  bool has_space_for(const log::LoggedGeometry& geometry) const noexcept;
  void record_geometry(const log::LoggedGeometry& geometry, std::size_t positions);
  /// Whether the ring has space for record_definition.
  template <class Value>
  bool has_space_for(const log::LoggedDefinition<Value>& definition) const noexcept {
    return recorder_.has_space_for(definition);
  }
  /// Records a material or a light.
  template <class Value>
  void record_definition(const log::LoggedDefinition<Value>& definition);

  // ---- the log's thread or the driver, from start to close
  /// Writes what is due, and gives back what waits for that. Returns when there is more to do.
  log::Writer::Step work() noexcept;

  // ---- any thread
  /// Number of transactions that are held.
  std::uint32_t held() const noexcept { return held_.count(); }
  Version durable() const noexcept { return writer_->durable(); }
  /// Waits until the version is on disk, at most this long. False: it is not.
  bool wait_until_durable(Version version, Nanoseconds at_most) noexcept;
  Durability state() const;

 private:
  CommitLog(std::shared_ptr<log::Disk> disk, const CommitLogOptions& options);
  Result<void> recover();
  Result<void> start_writer();

  // The log's thread, or the driver.
  void run_thread() noexcept;
  void end_log() noexcept;
  Result<void> close_writer();
  void publish_progress() noexcept;
  void return_held() noexcept;
  void sleep(LogWakeUp::Counts seen, const log::Writer::Step& step) noexcept;

  void notify_thread() noexcept;

  /// Waits on `progress_` until the condition holds.
  template <class Condition>
  void wait_until(Condition holds) noexcept;

  log::Ring ring_;  // the first member: it is aligned to a cache line
  const CommitLogOptions options_;
  MonotonicClock monotonic_clock_;
  const Clock& clock_;
  const std::shared_ptr<log::Disk> disk_;
  std::unique_ptr<log::DiskLock> lock_;
  std::optional<log::Recovered> recovered_;
  Recovery recovery_;
  std::uint64_t database_id_ = 0, next_geometry_file_ = 1;

  log::Recorder recorder_;  ///< the engine thread; the log's, once that has ended
  WorldCopy world_copy_;
  std::unique_ptr<log::Writer> writer_;
  LogOwner* owner_ = nullptr;
  const Clock* deadline_clock_ = nullptr;

  LogWakeUp wake_up_;
  std::atomic<bool> closing_{false};
  std::atomic<bool> in_gap_{false};
  bool is_driven_ = false;                  ///< a driver works for it: started, and not closed
  std::atomic<std::uint32_t> progress_{0};  ///< grows when the disk has more, or refuses
  std::atomic<std::uint32_t> waiters_{0};
  HeldTransactions held_;

  // The log's thread, or the driver.
  struct Progress {
    Version durable = 0;
    std::uint64_t records = 0;
    bool refused = false, waits_for_checkpoint = false;
    bool operator==(const Progress&) const = default;
  };
  Progress published_;
  Result<void> closed_;

  std::thread thread_;
};

}  // namespace rtstdb::transaction
