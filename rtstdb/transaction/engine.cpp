#include "rtstdb/transaction/engine.hpp"

#include <pthread.h>
#include <sched.h>

#include <new>
#include <system_error>
#include <utility>

#include <rtstdb/result.hpp>

#include "rtstdb/threads/signals_blocked.hpp"
#include "rtstdb/transaction/late_answers.hpp"
#include "rtstdb/transaction/shape_job.hpp"
#include "rtstdb/transaction/snapshot_job.hpp"

namespace rtstdb::transaction {

namespace {

class CallJob final : public EngineJob {
 public:
  explicit CallJob(const std::function<void()>& work) : work_(work) {}
  bool step(const store::Store&) noexcept override {
    work_();
    return true;
  }

 private:
  const std::function<void()>& work_;
};

TransactionImpl& impl(scheduler::ScheduledTransaction& transaction) noexcept {
  return static_cast<TransactionImpl&>(transaction);
}

TransactionImpl* impl(scheduler::ScheduledTransaction* transaction) noexcept {
  return static_cast<TransactionImpl*>(transaction);
}

bool is_cancelled(const scheduler::ScheduledTransaction& transaction) noexcept {
  return transaction.cancel_requested();
}

/// The transaction takes far less time than a group of the log waits for the disk.
bool is_brief(const TransactionImpl& transaction) noexcept {
  constexpr std::size_t few = 8;
  const store::WriteSet& set = transaction.write_set();
  return !transaction.has_queries() && set.shapes.empty() && set.writes.size() <= few &&
         transaction.preconditions().size() <= few && transaction.read_count() <= few;
}

}  // namespace

Engine::Engine(EngineOptions options, query::Executor& executor, const Clock& clock,
               std::unique_ptr<CommitLog> log)
    : max_entities_(options.store.max_entities),
      is_history_(static_cast<bool>(options.past)),
      chunk_(options.chunk),
      // A real-time thread that spins would starve the threads that it waits for.
      spin_(options.thread_priority > 0 ? Nanoseconds(0) : spin_where_possible(options.spin)),
      clock_(clock),
      latest_(VersionInfo{}),
      store_(std::move(options.store)),
      queue_(options.queue_capacity),
      preemption_(queue_, reservations_, store_, clock),
      admission_({costs_, queue_, reservations_, preemption_, clock}, options.chunk, is_history_),
      log_(std::move(log)),
      queries_(executor, clock, costs_, options.chunk),
      commit_path_({store_, queries_, preemption_.runs(), costs_, clock, log_.get()}),
      revival_(executor, queue_, clock) {
  if (log_ != nullptr) log_->restore(store_);
  if (is_history_) options.past(store_);
  latest_.set(store_.latest());
  const threads::SignalsBlocked inherited_by_the_thread;
  thread_ = std::thread([this] { run_thread(); });
  try {
    helper_.start();
    if (log_ != nullptr) log_->start(*this, clock_);
  } catch (...) {
    close();
    throw;
  }
  pthread_setname_np(thread_.native_handle(), "rtstdb");
  pthread_setname_np(helper_.thread().native_handle(), "rtstdb writes");
  set_priority(thread_, options.thread_priority);
  set_priority(helper_.thread(), options.thread_priority);
}

Engine::~Engine() {
  close();
}

void Engine::set_priority(std::thread& thread, int priority) {
  // Set in any case: a thread inherits its creator's policy.
  sched_param parameters{};
  parameters.sched_priority = priority;
  const int refusal =
      pthread_setschedparam(thread.native_handle(), priority > 0 ? SCHED_FIFO : SCHED_OTHER, &parameters);
  if (refusal == 0 || !degraded_.empty()) return;  // both threads are refused for the same reason
  degraded_.push_back("the database's engine thread runs without SCHED_FIFO priority " +
                      std::to_string(priority) + ": " + std::generic_category().message(refusal));
}

void Engine::close() noexcept {
  if (!thread_.joinable()) return;
  closing_.store(true, std::memory_order_release);
  notify();
  thread_.join();
  helper_.stop();
  if (log_ != nullptr) static_cast<void>(log_->close());
}

// ---- any thread

std::unique_ptr<Transaction> Engine::make_transaction(const TransactionOptions& options) const {
  return std::make_unique<TransactionImpl>(options, *this);
}

void Engine::submit(Transaction& transaction) noexcept {
  auto& submitted = static_cast<TransactionImpl&>(transaction);
  RTSTDB_REQUIRE(&submitted.engine() == this, "Database::submit",
                 "the transaction was made by another database");
  RTSTDB_REQUIRE(
      getpid() == process_, "Database::submit",
      "this process was forked from the one that opened the database and has none of its threads; open a "
      "database in this process");
  submitted.mark_pending();
  submitted.draft().submitted = clock_.now();
  scheduler::Reservations::submitted(submitted, *this);
  outcomes_.submitted();
  if (submitted_.push(submitted)) {
    notify();
  } else {
    finish_cancelled(submitted, CancelledBy::closing);
  }
}

void Engine::cancel(Transaction& transaction) noexcept {
  auto& submitted = static_cast<TransactionImpl&>(transaction);
  RTSTDB_REQUIRE(&submitted.engine() == this, "Database::cancel",
                 "the transaction was made by another database");
  if (!submitted.request_cancel()) return;
  cancels_requested_.fetch_add(1, std::memory_order_release);
  notify();
}

const Outcome& Engine::wait(Transaction& transaction) noexcept {
  auto& submitted = static_cast<TransactionImpl&>(transaction);
  RTSTDB_REQUIRE(submitted.status() != Status::idle, "Database::wait",
                 "the transaction was not submitted (Database::submit)");
  thread_local Spin spin;
  const auto has_outcome = [&] { return submitted.status() != Status::pending; };
  if (!has_outcome() && !spin.until(spin_, has_outcome)) submitted.wait();
  return submitted.outcome();
}

Result<std::vector<EntityState>> Engine::snapshot(const ReadAt& read_at) {
  SnapshotJob job(read_at, max_entities_);
  execute_job(job);
  return std::move(job).take();
}

Result<std::vector<glm::vec3>> Engine::shape(GeometryId geometry, std::size_t positions,
                                             const ReadAt& read_at) {
  ShapeJob job(geometry, positions, read_at);
  execute_job(job);
  return std::move(job).take();
}

void Engine::call(const std::function<void()>& work) {
  CallJob job(work);
  execute_job(job);
}

void Engine::execute_job(EngineJob& job) noexcept {
  give_job(job);
  job.wait();
}

void Engine::give_job(EngineJob& job) noexcept {
  const bool open = jobs_.give(job);
  RTSTDB_REQUIRE(open, "Database", "the database is closed (Database::close)");
  notify();
}

void Engine::listen(CommitListener* listener) {
  call([&] { listener_ = listener; });
}

Result<void> Engine::calibrate(Transaction& transaction) {
  auto& declared = static_cast<TransactionImpl&>(transaction);
  RTSTDB_REQUIRE(&declared.engine() == this, "Database::calibrate",
                 "the transaction was made by another database");
  RTSTDB_REQUIRE(declared.status() == Status::idle, "Database::calibrate",
                 "the transaction was submitted; call Transaction::begin and declare it first");
  declared.require_begun("Database::calibrate");
  if (is_history_ && declared.writes())
    return Error{ErrorCode::bad_input, "the transaction writes, and a history can not be written"};
  if (clock_.is_virtual()) return {};
  Status status = Status::committed;
  call([&] { status = commit_path_.calibrate(declared); });
  Outcome outcome = std::exchange(declared.draft(), Outcome{});
  if (status == Status::committed) return {};
  outcome.status = status;
  return Error{status == Status::device_lost ? ErrorCode::device_lost : ErrorCode::bad_input,
               describe(outcome)};
}

Result<std::unique_ptr<Reservation>> Engine::reserve(const ReservationOptions& options) {
  scheduler::ReservationOwner& owner = *this;
  auto reservation = std::make_unique<scheduler::ReservationImpl>(options, owner);
  Result<void> admitted;
  call([&] {
    try {
      admitted = admit_reservation(*reservation);
    } catch (const std::bad_alloc&) {
      admitted =
          Error{ErrorCode::out_of_memory, "reservation '" + options.name + "' does not fit into memory"};
    }
  });
  if (!admitted) return admitted.error();
  return std::unique_ptr<Reservation>(std::move(reservation));
}

Result<void> Engine::admit_reservation(scheduler::ReservationImpl& reservation) {
  // Under a virtual clock no work takes time.
  if (clock_.is_virtual()) return reservations_.add(reservation, Nanoseconds(0));
  if (chunk_ == Nanoseconds(0)) {
    return Error{ErrorCode::capacity,
                 "reservation '" + reservation.options().name +
                     "': DatabaseOptions::chunk is 0, so that other work can not be preempted"};
  }
  const scheduler::CostModel::Pieces pieces = costs_.longest_pieces();
  return reservations_.add(reservation, std::max(chunk_ + pieces.structures, pieces.commit));
}

void Engine::remove_reservation(scheduler::ReservationImpl& reservation) noexcept {
  const std::function<void()> work = [&] { reservations_.remove(reservation); };
  CallJob job(work);
  take_job(job);  // its owner may have closed the database
  job.wait();
}

SchedulerCounts Engine::scheduler_counts() const {
  SchedulerCounts counts = accuracy_.read();
  counts.reservations = reservations_.counts();
  counts.restarts = restarts_.load(std::memory_order_relaxed);
  return counts;
}

void Engine::notify() noexcept {
  wake_up_.notify();
  helper_.notify();
}

// ---- the end of a transaction

void Engine::settle(TransactionImpl& transaction, Status status) noexcept {
  late_answers::settle(transaction, status, clock_);
  reservations_.ended(transaction, status);
}

void Engine::return_to_owner(TransactionImpl& transaction, Status status) noexcept {
  outcomes_.ended(status, transaction.ScheduledTransaction::outcome(), transaction.terms());
  scheduler::Reservations::returned(transaction);
  transaction.finish(status);  // its owner may destroy it from here on
}

void Engine::finish(TransactionImpl& transaction, Status status) noexcept {
  settle(transaction, status);
  const bool firm_commit =
      transaction.is(DeadlineClass::firm) && (status == Status::committed || status == Status::truncated);
  const ClockTime deadline = transaction.terms().deadline;
  return_to_owner(transaction, status);
  if (firm_commit && clock_.now() > deadline) outcomes_.count_delivered_late();
}

void Engine::finish_cancelled(TransactionImpl& transaction, CancelledBy by) noexcept {
  transaction.draft().cancelled_by = by;
  finish(transaction, Status::cancelled);
}

// ---- the engine thread

void Engine::run_thread() noexcept {
  helper_.lock().lock();
  while (!is_closing()) {
    const std::uint32_t seen = wake_up_.count();
    if (work_once()) continue;
    if (!spin_before_sleep_.until(spin_, [&] { return wake_up_.count() != seen; })) wake_up_.wait(seen);
  }
  cancel_all();
  helper_.lock().unlock();
}

bool Engine::work_once() noexcept {
  if (log_ != nullptr) log_->end_gap_if_possible();
  if (revival_.is_needed()) {
    hand_over_log();
    revival_.revive(*this);
  }
  receive();
  TransactionImpl* const first = impl(queue_.pop());
  if (first != nullptr) {
    execute_and_log(*first);
  } else {
    hand_over_log();
  }
  const bool stepped = step_job();
  return first != nullptr || stepped;
}

bool Engine::step_job() noexcept {
  if (jobs_.oldest() == nullptr) return false;
  hand_over_log();  // a step may take long
  jobs_.step(store_);
  return true;
}

void Engine::cancel_all() noexcept {
  for (scheduler::HandOverLink* waiting = submitted_.close(); waiting != nullptr;) {
    scheduler::HandOverLink* const next = waiting->next;
    finish_cancelled(static_cast<TransactionImpl&>(*waiting), CancelledBy::closing);
    waiting = next;
  }
  while (TransactionImpl* const waiting = impl(queue_.pop()))
    finish_cancelled(*waiting, CancelledBy::closing);
  hand_over_log();
  jobs_.finish(store_);
}

// ---- the thread that holds the lock

void Engine::receive() noexcept {
  received_at_ = wake_up_.count();
  scheduler::HandOverLink* submitted = submitted_.take_all();
  while (submitted != nullptr) {
    scheduler::HandOverLink* const next = submitted->next;
    auto& transaction = static_cast<TransactionImpl&>(*submitted);
    if (const auto status = admission_.decide(transaction)) {
      finish(transaction, *status);
    } else {
      enqueue(transaction);
    }
    submitted = next;
  }
  const std::uint32_t requested = cancels_requested_.load(std::memory_order_acquire);
  if (std::exchange(cancels_handled_, requested) != requested) drop_cancelled();
}

void Engine::drop_cancelled() noexcept {
  while (TransactionImpl* const waiting = impl(queue_.pop_first(is_cancelled)))
    finish_cancelled(*waiting, CancelledBy::caller);
}

void Engine::enqueue(TransactionImpl& transaction) noexcept {
  if (queue_.full()) {
    TransactionImpl& displaced = impl(queue_.displace(transaction));
    finish_cancelled(displaced, CancelledBy::full_queue);
    if (&displaced == &transaction) return;
  }
  queue_.push(transaction);
}

void Engine::execute_and_log(TransactionImpl& transaction) noexcept {
  if (log_ == nullptr) return execute(transaction);
  // Not after each brief commit: the owner of the next one would wait for it, too.
  if (!is_brief(transaction)) log_->hand_over();
  const Version before = store_.latest().version;
  execute(transaction);
  // The log collects a limited number of commits; of other transactions there may be any number.
  if (store_.latest().version == before) log_->hand_over();
}

void Engine::execute(TransactionImpl& transaction) noexcept {
  if (transaction.cancel_requested()) return finish_cancelled(transaction, CancelledBy::caller);
  const Status status = commit_path_.execute(transaction, this);
  if (status == Status::pending) return restart(transaction);
  if (store_.latest().version != latest_.get().version) {
    if (listener_ != nullptr) listener_->committed(transaction.write_set());
    latest_.set(store_.latest());
  }
  accuracy_.ended(transaction, status);
  const bool is_held =
      log_ != nullptr && log_->mode() == DurabilityMode::group && transaction.writes() && is_done(status);
  if (!is_held) return finish(transaction, status);
  settle(transaction, status);
  transaction.draft().status = status;
  log_->hold(transaction);
}

void Engine::restart(TransactionImpl& transaction) noexcept {
  Outcome& outcome = transaction.draft();
  ++outcome.restarts;
  restarts_.fetch_add(1, std::memory_order_relaxed);
  if (transaction.cancel_requested()) return finish_cancelled(transaction, CancelledBy::caller);
  transaction.slack -= clock_.now() - outcome.started;
  enqueue(transaction);
}

// ---- while a run waits for the device, and at its preemption points

void Engine::begin_wait() noexcept {
  hand_over_log();
  preemption_.begin_wait();
  helper_.begin_wait([&] { return wake_up_.count() != received_at_ || !queue_.empty(); });
}

void Engine::end_wait() noexcept {
  helper_.end_wait();
  preemption_.end_wait();
}

void Engine::work_in_wait() noexcept {
  if (is_closing()) return;
  receive();
  while (TransactionImpl* const late = impl(revival_.pop_unmeetable()))
    finish(*late, Status::device_lost);
  const auto only_writes = [this](const scheduler::ScheduledTransaction& waiting) {
    return waiting.writes() && !waiting.has_queries() && preemption_.can_execute(waiting);
  };
  while (!helper_.device_is_done()) {
    TransactionImpl* const writer = impl(queue_.pop_first(only_writes));
    if (writer == nullptr) break;
    execute_and_log(*writer);
  }
  hand_over_log();
  preemption_.request_if_useful();
}

query::ExecutorCallbacks::Continuation Engine::on_preemption_point() noexcept {
  receive();
  scheduler::Run& run = preemption_.runs().innermost();
  scheduler::ScheduledTransaction& transaction = *run.transaction;
  if (transaction.cancel_requested()) return Continuation::stop;
  if (transaction.reserved) reservations_.enforce_budget(transaction, run.time.total(clock_.now()));
  late_answers::begin_point(run, clock_);
  if (preemption_.is_due()) {
    preemption_.suspend();
    while (TransactionImpl* const next = impl(preemption_.next())) {
      execute(*next);
      receive();
    }
    preemption_.resume();
    if (run.must_restart) return Continuation::stop;
  }
  if (late_answers::ends_in_time(run, clock_)) return Continuation::finish_in_flight;
  const bool too_late = transaction.is(DeadlineClass::firm) && clock_.now() > transaction.terms().deadline;
  return too_late ? Continuation::stop : Continuation::go_on;
}

// ---- the log's thread

void Engine::take_job(EngineJob& job) noexcept {
  if (jobs_.give(job)) return notify();
  // The engine thread has ended, or does the last jobs.
  const std::lock_guard guard(helper_.lock());
  while (!job.step(store_)) {
  }
  job.mark_done();
}

void Engine::return_held(TransactionImpl& transaction) noexcept {
  return_to_owner(transaction, transaction.ScheduledTransaction::outcome().status);
}

}  // namespace rtstdb::transaction
