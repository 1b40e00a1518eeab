#pragma once
// The heart of the database: takes transactions from any thread, admits, orders and carries them out on a
// thread of its own, and gives each back with exactly one outcome.
//
//   submit -> hand-over (lock-free) -> admission -> ready queue -> Runner -> outcome, owner woken
//
// Admission
//   firm: a deadline that has passed is missed; one that can not be met by what is left of those that run, and by the
//   costs of this transaction and of all that go before it, is refused; so is one that would break what was promised to
//   another firm transaction of its importance. The earliest deadline that could be met is named, with some time to ask
//   for it. Only where each kind of work in it has been measured often enough, and not under a virtual clock. Refused
//   work gives no measurements: so that a prediction that has become too high does not refuse for ever, each 16th of a
//   row is let in, without a promise. queue full: the least urgent best-effort transaction is cancelled, else the newcomer.
// Order: reserved ones by when they are due (reservations.hpp); then importance, then earliest deadline, then arrival. What asks is interrupted between two chunks by what goes
// before it, which runs inside that gap; so transactions stand in one another, the most urgent innermost.
//
// Two threads: the engine's, and a relief that only works while the engine's waits for the device.
//
// Cancelling marks the transaction; whoever carries it further the next time gives it back.
//
// Threads: submit, wait, cancel, latest, counts, snapshot and call from any; constructor, make_transaction and
// destructor are setup. submit, wait, cancel and latest neither allocate nor take a lock.

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/store/store.hpp"
#include "rtstdb/threads/bell.hpp"
#include "rtstdb/transaction/accuracy.hpp"
#include "rtstdb/transaction/commit_listener.hpp"
#include "rtstdb/transaction/commit_log.hpp"
#include "rtstdb/scheduler/cost_model.hpp"
#include "rtstdb/transaction/engine_job.hpp"
#include "rtstdb/transaction/hand_over.hpp"
#include "rtstdb/transaction/latest_version.hpp"
#include "rtstdb/transaction/preemption_latency.hpp"
#include "rtstdb/transaction/ready_queue.hpp"
#include "rtstdb/transaction/reservations.hpp"
#include "rtstdb/transaction/runner.hpp"
#include "rtstdb/transaction/spin.hpp"
#include "rtstdb/transaction/tally.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

struct EngineOptions {
  store::StoreOptions store;  ///< geometry_known is called on the engine's thread
  std::uint32_t queue_capacity = 256;
  Nanoseconds chunk{0};  ///< see DatabaseOptions
  /// SCHED_FIFO priority of the engine's thread, 0: ordinary. Where it is refused, degraded() says so.
  int thread_priority = 0;
  double max_reserved_share = 0.8;
  Nanoseconds spin{0};  ///< see DatabaseOptions
  /// Fills the store before all else; then nobody writes (RefusedBy::read_only).
  std::function<void(store::Store&)> past = {};
};

class Engine final : private query::ExecutorCallbacks, private LogOwner {
 public:
  /// The executor is called on the engine's thread alone. Executor and clock must outlive the engine. With a log, it goes on from
  /// the world that was recovered.
  Engine(EngineOptions options, query::Executor& executor, const Clock& clock,
         std::unique_ptr<CommitLog> log = nullptr);
  /// Closes.
  ~Engine() override;
  Engine(const Engine&) = delete;
  Engine& operator=(const Engine&) = delete;

  std::unique_ptr<Transaction> make_transaction(const TransactionOptions& options) const;

  /// The transaction is this engine's and was begun since its last outcome. After close: cancelled at once.
  void submit(Transaction& transaction) noexcept;
  /// Misuse when it was never submitted.
  const Outcome& wait(Transaction& transaction) noexcept;
  void cancel(Transaction& transaction) noexcept;
  VersionInfo latest() const noexcept { return latest_.get(); }

  /// All entities of a version, by ascending index. The caller waits while the engine copies in slices.
  /// Errors: bad_input when the version is unknown or no longer kept. Misuse after close.
  Result<std::vector<EntityState>> snapshot(const ReadAt& read_at);
  /// The positions of a geometry that deforms, which has so many, in a version. Errors: bad_input when the version is
  /// unknown or its shapes are no longer kept. Misuse after close.
  Result<std::vector<glm::vec3>> shape(GeometryId geometry, std::size_t positions, const ReadAt& read_at);
  /// A geometry deforms from now on. Inside call.
  void keep_shapes(GeometryId geometry, std::unique_ptr<store::ShapeHistory::Kept> shapes) noexcept {
    store_.keep_shapes(geometry, std::move(shapes));
  }
  /// Runs `work`, which must not throw, on the engine's thread between two transactions and waits for it. For
  /// setup: transactions wait meanwhile. Misuse after close.
  void call(const std::function<void()>& work);

  /// Has the job's steps done by the engine's thread and waits for the last. Misuse after close.
  void carry_out(EngineJob& job) noexcept;
  /// Who is told what is committed from now on; null: nobody. It stays until somebody else is. Setup; misuse after close.
  void listen(CommitListener* listener);

  /// See Database::calibrate. Misuse after close.
  Result<void> calibrate(Transaction& transaction);

  /// See Database::reserve. Misuse after close.
  Result<std::unique_ptr<Reservation>> reserve(const ReservationOptions& options);
  void give_back(ReservationImpl& reservation) noexcept;

  SchedulerCounts scheduler_counts() const;
  TransactionCounts counts() const noexcept { return tally_.read(); }
  /// Null: nothing survives.
  CommitLog* log() const noexcept { return log_.get(); }
  /// What the machine did not permit, in words.
  const std::vector<std::string>& degraded() const noexcept { return degraded_; }

  /// Lets the transaction that runs finish, cancels all that wait, ends the threads and the log, which says how that went
  /// (CommitLog::close). Again: does nothing. One thread at a time.
  void close() noexcept;
  /// Whether close was called.
  bool is_closing() const noexcept { return closing_.load(std::memory_order_acquire); }

 private:
  void run_thread() noexcept;
  bool work_once() noexcept;
  // gaps.cpp: what is done while a transaction waits for the device, and between its chunks.
  void begin_wait() noexcept override;
  void end_wait() noexcept override;
  bool preemption_requested() noexcept override;
  void on_outer_drained(Nanoseconds time) noexcept override;
  Gap on_preemption_point() noexcept override;
  /// The relief's thread: while a transaction waits for the device, admits or refuses what comes; and carries out those
  /// that only write, since they need no device, where the one that waits only reads. So a tick's write waits
  /// microseconds, not for another thread's queries.
  void run_write_helper() noexcept;
  void carry_out_writes() noexcept;
  /// Whether in a gap of this one something would be done.
  bool somebody_would_pass(const TransactionImpl& transaction) const noexcept;
  // logging.cpp
  void take_job(EngineJob& job) noexcept override;
  void give_back_held(TransactionImpl& transaction) noexcept override;
  void tend_log_soon() noexcept override { ring(); }
  bool is_held(const TransactionImpl& transaction, Status status) const noexcept;
  // admission.cpp
  void receive() noexcept;
  void admit(TransactionImpl& transaction) noexcept;
  /// Whoever has to go for it, perhaps itself, is cancelled.
  void wait_in_queue(TransactionImpl& transaction) noexcept;
  bool passes_admission(TransactionImpl& transaction, ClockTime now) noexcept;
  /// When a newcomer would be done with this deadline, if nothing else came.
  ClockTime expected_end(ClockTime now, const TransactionImpl& transaction,
                         ClockTime deadline) const noexcept;
  /// Whether there is a prediction for each one that a newcomer would wait for.
  bool all_known_before(const TransactionImpl& transaction, ClockTime deadline) const noexcept;
  /// What is left of those that run until a newcomer's turn.
  Nanoseconds rest_before(ClockTime now, const TransactionImpl& transaction,
                          ClockTime deadline) const noexcept;
  /// Those to whom a promise was made, and before whom a newcomer goes.
  template <class Each>
  void for_each_lower_priority(const TransactionImpl& transaction, ClockTime deadline, Each each) noexcept;
  /// The earliest deadline among the promises of its importance that a newcomer would break.
  std::optional<ClockTime> first_broken(const TransactionImpl& transaction, ClockTime deadline) noexcept;
  void take_from_slack(const TransactionImpl& transaction) noexcept;
  /// The earliest deadline from its own on that is admitted when it is asked for at once.
  ClockTime earliest_feasible(ClockTime now, const TransactionImpl& transaction) noexcept;
  // reserve.cpp
  Result<void> admit_reservation(ReservationImpl& reservation);
  /// One that has cost more than its budget has its rank no longer.
  void enforce_budget(const Running& running) noexcept;
  /// Whether one that waits may run inside the gap of the innermost one.
  bool may_nest(const TransactionImpl& waiting) const noexcept;
  /// Whether the innermost one stands in the way of a reserved one, and gives way to it.
  bool has_to_give_way(const TransactionImpl& innermost) const noexcept;
  /// One that gave way waits again.
  void put_back(TransactionImpl& transaction) noexcept;
  /// When one that would be done by `end` is done behind the reserved ones that may still come before.
  ClockTime behind_reserved(ClockTime now, ClockTime end) const noexcept;
  void carry_out(TransactionImpl& transaction) noexcept;
  /// And hands over what the log has collected, where that would wait for long.
  void carry_out_and_log(TransactionImpl& transaction) noexcept;
  void end(TransactionImpl& transaction, Status status) noexcept;
  void finish(TransactionImpl& transaction, Status status) noexcept;
  /// What its queries' answers are worth, and its reservation.
  void settle(TransactionImpl& transaction, Status status) noexcept;
  // device_loss.cpp
  void revive_device() noexcept;
  /// While the device is being revived: gives back those that ask and whose firm deadline comes before it can.
  void fail_unmeetable() noexcept;
  void finish_cancelled(TransactionImpl& transaction, CancelledBy by) noexcept;
  void drop_cancelled() noexcept;
  bool step_job() noexcept;
  void cancel_all() noexcept;
  void give_job(EngineJob& job) noexcept;
  void ring() noexcept;
  void sleep_unless_rung(std::uint32_t heard) noexcept;
  void set_priority(std::thread& thread, int priority);

  const std::uint32_t max_entities_;
  const bool is_past_;
  const Nanoseconds chunk_;
  const double max_reserved_share_;
  const Nanoseconds spin_;  ///< zero: neither owners nor the engine do
  const Clock& clock_;
  query::Executor& executor_;
  Tally tally_;
  Accuracy accuracy_;
  std::atomic<std::uint64_t> restarts_{0};
  HandOver submitted_;
  HandOver jobs_given_;
  threads::Bell bell_;  ///< rung when there is anything to look at
  std::atomic<std::uint32_t> cancels_asked_{0};
  std::atomic<bool> closing_{false};

  std::atomic<bool> waits_for_device_{false};
  std::atomic<bool> device_is_done_{false};     ///< the relief hands the lock back
  std::atomic<bool> gap_is_awaited_{false};     ///< found by the relief in this wait
  std::optional<ClockTime> gap_awaited_since_;  ///< likewise; whoever has the lock
  const TransactionImpl* waits_ = nullptr;      ///< of the engine's thread: who waits for the device
  threads::Bell relief_bell_;

  // The engine's thread alone, once it runs; it holds the lock except in its waits for the device, where the
  // relief may take it for a few writes.
  std::mutex working_;
  store::Store store_;
  CommitListener* listener_ = nullptr;
  LatestVersion latest_;  ///< written by it, read by any
  scheduler::CostModel costs_;
  PreemptionLatency preemption_latency_;
  ReadyQueue queue_;
  Reservations reservations_;
  Runner runner_;
  HandOverLink* jobs_ = nullptr;   ///< taken over, oldest first
  std::uint32_t received_at_ = 0;  ///< the bell when submissions were last taken over
  std::uint32_t cancels_seen_ = 0;
  std::uint64_t arrivals_ = 0;
  std::uint32_t refused_in_a_row_ = 0;
  Spin spin_before_sleep_;
  std::optional<ClockTime> device_back_at_;  ///< while it is being revived: about then

  std::vector<std::string> degraded_;
  const std::unique_ptr<CommitLog> log_;
  std::thread thread_;
  std::thread relief_;
};

}  // namespace rtstdb::transaction
