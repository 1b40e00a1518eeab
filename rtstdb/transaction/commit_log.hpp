#pragma once
// The engine's log: recovers the world, records commits into a ring, and has a thread that brings them to the disk, holds what waits
// for that, and gives it back.
//
//   async   record -> ring                              the thread writes each flush_interval, or when the ring is half full
//   group   record -> ring, hold -> hand-over           the thread writes, then gives back all whose version is on disk
//   sync    record -> ring, the engine waits            the thread writes, and wakes it
//
// Threads: open, restore and start are setup; what is the engine's thread's says so, and neither allocates nor takes a lock nor, but for sync
// mode, waits; the rest is anybody's.

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
#include "rtstdb/transaction/hand_over.hpp"
#include "rtstdb/transaction/log_bell.hpp"
#include "rtstdb/transaction/monotonic_clock.hpp"
#include "rtstdb/transaction/world_copy.hpp"

namespace rtstdb::transaction {

class TransactionImpl;

/// What the log wants of the engine; called on the log's thread.
class LogOwner : public JobTaker {
 public:
  /// A transaction that was held; its outcome says whether it is durable.
  virtual void give_back_held(TransactionImpl& transaction) noexcept = 0;
  /// There is room again for what tend() does.
  virtual void tend_log_soon() noexcept = 0;
};

/// Drives a log in the place of its thread, so that a simulation says when the log has its turn.
class LogDriver {
 public:
  virtual ~LogDriver() = default;
  /// The engine waits for the log: calls CommitLog::work once at least.
  virtual void log_is_waited_for() noexcept = 0;
};

struct CommitLogOptions {
  DurabilityOptions durability;  ///< all but the directory and volatile_only
  std::uint32_t max_entities = 4096;
  std::uint32_t max_geometries = 1024;
  /// What the log's own intervals are measured by; null: CLOCK_MONOTONIC. Deadlines have another one.
  const Clock* clock = nullptr;
  /// Null: the log has a thread of its own. Outlives the log.
  LogDriver* driver = nullptr;
};

class CommitLog {
 public:
  /// With the right to write, the world recovered and a first segment on disk. Errors: file, capacity; see Database::open.
  static Result<std::unique_ptr<CommitLog>> open(std::shared_ptr<log::Disk> disk,
                                                 const CommitLogOptions& options);
  CommitLog(const CommitLog&) = delete;
  CommitLog& operator=(const CommitLog&) = delete;
  /// Closes.
  ~CommitLog();

  DurabilityMode mode() const noexcept { return options_.durability.mode; }
  const Recovery& recovery() const noexcept { return recovery_; }
  /// Until restore has taken it.
  const log::World& recovered_world() const noexcept { return recovered_->world; }

  // ---- setup
  /// Gives the store what was recovered.
  void restore(store::Store& store);
  /// Starts the thread, where nobody else drives. Owner and clock, which deadlines are on, outlive it.
  void start(LogOwner& owner, const Clock& deadline_clock);
  /// The mesh in a file of its own, on disk. One thread at a time.
  Result<log::LoggedGeometry> write_geometry(const TriangleMesh& mesh, std::string_view name,
                                             const GeometryOptions& options);
  /// Nobody commits any more: writes what is there, ends the log, gives back what is held and ends the thread. Again: says the same.
  Result<void> close() noexcept;

  // ---- the engine's thread
  /// Why writes can not be promised to be durable now, where that is promised.
  std::optional<RefusedBy> refuses(const store::WriteSet& set) const noexcept;
  /// Async and group: the set has been published. Async: the log's thread may not see it before hand_over.
  void record(const store::WriteSet& set) noexcept;
  /// To be called before the engine waits for anything.
  void hand_over() noexcept;
  /// Group: gives the transaction back, which is done and has its status in its outcome, when it is on disk, or the disk refuses.
  void hold(TransactionImpl& transaction) noexcept;
  /// Sync: the set has been staged. Waits until it is on disk; false: the disk refuses.
  bool write_through(const store::WriteSet& set) noexcept;
  /// Sync: of the set that was recorded last. Waits until that is on disk; false: the disk refuses.
  bool take_back(Version version) noexcept;
  /// To be called now and then.
  void tend() noexcept;
  /// Whether there is room for record_geometry.
  bool room_for(const log::LoggedGeometry& geometry) const noexcept;
  void record_geometry(const log::LoggedGeometry& geometry, std::size_t positions);

  // ---- whoever drives it, one call at a time, from start to close
  /// Brings to the disk what is due, and gives back what has waited for that. When there is more to do: as the writer's step.
  log::Writer::Step work() noexcept;

  // ---- any thread
  /// So many are held and not given back.
  std::uint32_t held() const noexcept { return held_count_.load(std::memory_order_acquire); }
  Version durable() const noexcept { return writer_->durable(); }
  bool wait_until_durable(Version version, Nanoseconds at_most) noexcept;
  Durability state() const;

 private:
  CommitLog(std::shared_ptr<log::Disk> disk, const CommitLogOptions& options);
  Result<void> recover();
  Result<void> start_writer();

  // The log's thread, or the driver's.
  void run_thread() noexcept;
  void end_log() noexcept;
  Result<void> close_writer();
  void tell_progress() noexcept;
  void give_back_held() noexcept;
  void give_back(TransactionImpl& transaction, bool durable) noexcept;
  void nap(LogBell::Heard heard, const log::Writer::Step& step) noexcept;

  void ring_bell() noexcept;

  /// Waits on `progress_` until the condition holds.
  template <class Condition>
  void wait_until(Condition holds) noexcept;

  log::Ring ring_;  // first: it begins at a cache line
  const CommitLogOptions options_;
  MonotonicClock monotonic_clock_;
  const Clock& clock_;
  const std::shared_ptr<log::Disk> disk_;
  std::unique_ptr<log::DiskLock> lock_;
  std::optional<log::Recovered> recovered_;
  Recovery recovery_;
  std::uint64_t database_id_ = 0, next_geometry_file_ = 1;

  log::Recorder recorder_;  // the engine's thread; the log's, once that has ended
  WorldCopy world_copy_;
  std::unique_ptr<log::Writer> writer_;
  LogOwner* owner_ = nullptr;
  const Clock* deadline_clock_ = nullptr;

  LogBell bell_;
  std::atomic<bool> closing_{false};
  std::atomic<bool> in_gap_{false};
  bool is_driven_ = false;                  ///< from outside: started, and not closed
  std::atomic<std::uint32_t> progress_{0};  ///< grows when the disk has more, or refuses
  std::atomic<std::uint32_t> waiters_{0};
  std::atomic<std::uint32_t> held_count_{0};
  HandOver held_given_;

  // The log's thread alone, or the driver's.
  HandOverLink* held_ = nullptr;  ///< oldest first
  HandOverLink** held_end_ = &held_;
  struct Told {
    Version durable = 0;
    std::uint64_t records = 0;
    bool refused = false, waits_for_checkpoint = false;
    bool operator==(const Told&) const = default;
  };
  Told told_;
  Result<void> closed_;

  std::thread thread_;
};

}  // namespace rtstdb::transaction
