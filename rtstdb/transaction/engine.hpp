#pragma once
// The database engine: takes transactions from any thread, executes them one after the other, and gives each
// back with exactly one outcome. It wires the parts; what each decides is described in its header.
//
//   submit -> HandOver -> Admission -> ReadyQueue -> CommitPath (QueryExecution -> Executor) -> outcome
//                                                      |  at preemption points: Preemption, and so on, nested
//
// Threads: its own, which executes transactions; the WriteHelper's, which executes writes while the engine's
// waits for the device; and the CommitLog's. The thread that executes holds one lock. A cancelled transaction
// is marked, and given back by the thread that handles it next.
//
// Threads of the callers: submit, wait, cancel, latest, counts, snapshot, shape, call and execute_job by any;
// constructor, destructor, make_transaction, listen, calibrate and reserve are setup. submit, wait, cancel
// and latest neither allocate nor take a lock.

#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/admission.hpp"
#include "rtstdb/scheduler/cost_model.hpp"
#include "rtstdb/scheduler/hand_over.hpp"
#include "rtstdb/scheduler/prediction_accuracy.hpp"
#include "rtstdb/scheduler/preemption.hpp"
#include "rtstdb/scheduler/ready_queue.hpp"
#include "rtstdb/scheduler/reservations.hpp"
#include "rtstdb/store/store.hpp"
#include "rtstdb/threads/event_count.hpp"
#include "rtstdb/transaction/commit_listener.hpp"
#include "rtstdb/transaction/commit_log.hpp"
#include "rtstdb/transaction/commit_path.hpp"
#include "rtstdb/transaction/device_revival.hpp"
#include "rtstdb/transaction/engine_job.hpp"
#include "rtstdb/transaction/job_queue.hpp"
#include "rtstdb/transaction/latest_version.hpp"
#include "rtstdb/transaction/outcome_counts.hpp"
#include "rtstdb/transaction/query_execution.hpp"
#include "rtstdb/transaction/spin.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"
#include "rtstdb/transaction/write_helper.hpp"

namespace rtstdb::transaction {

struct EngineOptions {
  store::StoreOptions store;  ///< geometry_known is called on the engine thread
  std::uint32_t queue_capacity = 256;
  Nanoseconds chunk{0};  ///< see DatabaseOptions
  /// SCHED_FIFO priority of the engine threads; 0: ordinary. Where it is refused, degraded() says so.
  int thread_priority = 0;
  Nanoseconds spin{0};  ///< of owners that wait, and of the engine's thread; zero: neither spins
  /// Fills the store at construction; afterwards every write is refused (RefusedBy::read_only).
  std::function<void(store::Store&)> past = {};
};

class Engine final : private query::ExecutorCallbacks,
                     private LogOwner,
                     private scheduler::ReservationOwner,
                     private WriteHelper::Work {
 public:
  /// Only the engine thread calls the executor. Executor and clock outlive the engine. With a log, the world
  /// begins as it was recovered.
  Engine(EngineOptions options, query::Executor& executor, const Clock& clock,
         std::unique_ptr<CommitLog> log = nullptr);
  /// Closes.
  ~Engine() override;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  std::unique_ptr<Transaction> make_transaction(const TransactionOptions& options) const;

  /// The transaction is this engine's and was begun since its last outcome (misuse). After close it ends as
  /// cancelled.
  void submit(Transaction& transaction) noexcept;
  /// Waits for the outcome. Misuse when the transaction was never submitted.
  const Outcome& wait(Transaction& transaction) noexcept;
  /// Cancels the transaction where its outcome is not decided yet.
  void cancel(Transaction& transaction) noexcept;
  /// The latest published version.
  VersionInfo latest() const noexcept { return latest_.get(); }

  /// All entities of a version, by ascending index. The engine copies in slices while the caller waits.
  /// Errors: bad_input when the version is unknown or no longer kept. Misuse after close.
  Result<std::vector<EntityState>> snapshot(const ReadAt& read_at);
  /// The `positions` vertices of a geometry that deforms, in a version. Errors: bad_input when the version is
  /// unknown or its shapes are no longer kept. Misuse after close.
  Result<std::vector<glm::vec3>> shape(GeometryId geometry, std::size_t positions, const ReadAt& read_at);
  /// The geometry deforms from now on. Inside call.
  void keep_shapes(GeometryId geometry, std::unique_ptr<store::ShapeHistory::Ring> shapes) noexcept {
    store_.keep_shapes(geometry, std::move(shapes));
  }
  /// Runs `work`, which must not throw, on the engine thread between two transactions, and waits for it. For
  /// setup: transactions wait as long. Misuse after close.
  void call(const std::function<void()>& work);
  /// Has the job done by the engine thread, and waits for it. Misuse after close.
  void execute_job(EngineJob& job) noexcept;
  /// Sets the listener that receives each commit; null: none. Misuse after close.
  void listen(CommitListener* listener);

  /// See Database::calibrate. Misuse after close.
  Result<void> calibrate(Transaction& transaction);
  /// See Database::reserve. Misuse after close.
  Result<std::unique_ptr<Reservation>> reserve(const ReservationOptions& options);

  SchedulerCounts scheduler_counts() const;
  TransactionCounts counts() const noexcept { return outcomes_.read(); }
  /// Null: commits are not recorded.
  CommitLog* log() const noexcept { return log_.get(); }
  /// Sentences about settings that the machine refused.
  const std::vector<std::string>& degraded() const noexcept { return degraded_; }

  /// Completes the transaction in execution, cancels all that wait, ends the threads and the log, which keeps
  /// the result (CommitLog::close). A second call does nothing. One thread at a time.
  void close() noexcept;
  /// Whether close was called.
  bool is_closing() const noexcept { return closing_.load(std::memory_order_acquire); }

 private:
  // query::ExecutorCallbacks
  void begin_wait() noexcept override;
  void end_wait() noexcept override;
  bool preemption_requested() noexcept override { return preemption_.requested(); }
  void begin_drain() noexcept override { preemption_.begin_drain(); }
  void end_drain() noexcept override { preemption_.end_drain(); }
  Continuation on_preemption_point() noexcept override;
  // WriteHelper::Work
  void work_in_wait() noexcept override;
  // LogOwner
  void take_job(EngineJob& job) noexcept override;
  void return_held(TransactionImpl& transaction) noexcept override;
  void end_gap_soon() noexcept override { notify(); }
  // scheduler::ReservationOwner
  void remove_reservation(scheduler::ReservationImpl& reservation) noexcept override;

  // The engine thread.
  void run_thread() noexcept;
  bool work_once() noexcept;
  void cancel_all() noexcept;
  // The thread that holds the lock.
  /// Admits or ends what was handed over, and gives back what was cancelled in the queue.
  void receive() noexcept;
  /// The transaction waits for its turn. A full queue cancels one transaction, perhaps this one.
  void enqueue(TransactionImpl& transaction) noexcept;
  void execute(TransactionImpl& transaction) noexcept;
  /// Executes it, and hands over to the log what it has collected where that would wait for long.
  void execute_and_log(TransactionImpl& transaction) noexcept;
  /// The transaction must restart: it waits again.
  void restart(TransactionImpl& transaction) noexcept;
  void drop_cancelled() noexcept;
  bool step_job() noexcept;
  void hand_over_log() noexcept {
    if (log_ != nullptr) log_->hand_over();
  }
  // Any thread: the end of a transaction that belongs to the caller.
  /// Its answers and its reservation are settled, and its owner gets it back.
  void finish(TransactionImpl& transaction, Status status) noexcept;
  void finish_cancelled(TransactionImpl& transaction, CancelledBy by) noexcept;
  void settle(TransactionImpl& transaction, Status status) noexcept;
  void return_to_owner(TransactionImpl& transaction, Status status) noexcept;

  Result<void> admit_reservation(scheduler::ReservationImpl& reservation);
  void give_job(EngineJob& job) noexcept;
  void notify() noexcept;
  void set_priority(std::thread& thread, int priority);

  const std::uint32_t max_entities_;
  const bool is_history_;
  const Nanoseconds chunk_;
  const Nanoseconds spin_;  ///< of owners and of the engine; zero: neither spins
  const Clock& clock_;
  const pid_t process_ = getpid();  ///< whose threads the engine has

  // Any thread.
  OutcomeCounts outcomes_;
  scheduler::PredictionAccuracy accuracy_;
  std::atomic<std::uint64_t> restarts_{0};
  scheduler::HandOver submitted_;
  JobQueue jobs_;
  threads::EventCount wake_up_;  ///< notified when the engine thread has something to look at
  std::atomic<std::uint32_t> cancels_requested_{0};
  std::atomic<bool> closing_{false};
  LatestVersion latest_;  ///< written under the lock, read by any

  // The lock, held by the engine thread except in its waits for the device; what it protects follows.
  WriteHelper helper_{*this};
  store::Store store_;
  CommitListener* listener_ = nullptr;
  scheduler::CostModel costs_;
  scheduler::ReadyQueue queue_;
  scheduler::Reservations reservations_;
  scheduler::Preemption preemption_;
  scheduler::Admission admission_;
  const std::unique_ptr<CommitLog> log_;
  QueryExecution queries_;
  CommitPath commit_path_;
  DeviceRevival revival_;
  std::uint32_t received_at_ = 0;  ///< its count when submissions were last taken over
  std::uint32_t cancels_handled_ = 0;

  Spin spin_before_sleep_;
  std::vector<std::string> degraded_;
  std::thread thread_;
};

}  // namespace rtstdb::transaction
