#include "rtstdb/transaction/engine.hpp"

#include <pthread.h>
#include <sched.h>

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

/// Carried out in less time than a group waits for the disk, by far.
bool is_brief(const TransactionImpl& transaction) noexcept {
  constexpr std::size_t few = 8;
  const store::WriteSet& set = transaction.write_set();
  return transaction.requests().empty() && set.shapes.empty() && set.writes.size() <= few &&
         transaction.preconditions().size() <= few && transaction.read_count() <= few;
}

}  // namespace

Engine::Engine(EngineOptions options, query::Executor& executor, const Clock& clock,
               std::unique_ptr<CommitLog> log)
    : max_entities_(options.store.max_entities),
      is_past_(static_cast<bool>(options.past)),
      chunk_(options.chunk),
      max_reserved_share_(options.max_reserved_share),
      // Real-time threads that spin starve whom they wait for.
      spin_(options.thread_priority > 0 ? Nanoseconds(0) : spin_where_possible(options.spin)),
      clock_(clock),
      executor_(executor),
      store_(std::move(options.store)),
      latest_(store_.latest()),
      queue_(options.queue_capacity),
      runner_(store_, executor, clock, costs_, options.chunk, log.get()),
      log_(std::move(log)) {
  if (log_ != nullptr) log_->restore(store_);
  if (is_past_) options.past(store_);
  latest_.set(store_.latest());
  const threads::SignalsBlocked inherited_by_the_thread;
  thread_ = std::thread([this] { run_thread(); });
  try {
    relief_ = std::thread([this] { run_write_helper(); });
    if (log_ != nullptr) log_->start(*this, clock_);
  } catch (...) {
    close();
    throw;
  }
  pthread_setname_np(thread_.native_handle(), "rtstdb");
  pthread_setname_np(relief_.native_handle(), "rtstdb relief");
  set_priority(thread_, options.thread_priority);
  set_priority(relief_, options.thread_priority);
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
  if (refusal == 0) return;
  if (!degraded_.empty()) return;  // both threads get the same answer
  degraded_.push_back("the database's thread runs without SCHED_FIFO priority " + std::to_string(priority) +
                      ": " + std::generic_category().message(refusal));
}

// ---- any thread

std::unique_ptr<Transaction> Engine::make_transaction(const TransactionOptions& options) const {
  return std::make_unique<TransactionImpl>(options, *this);
}

void Engine::submit(Transaction& transaction) noexcept {
  auto& submitted = static_cast<TransactionImpl&>(transaction);
  RTSTDB_REQUIRE(&submitted.engine() == this, "Database::submit",
                 "the transaction was made by another database");
  submitted.mark_pending();
  submitted.draft().submitted = clock_.now();
  Reservations::submitted(submitted);
  tally_.submitted();
  if (submitted_.push(submitted)) {
    ring();
  } else {
    finish_cancelled(submitted, CancelledBy::closing);
  }
}

void Engine::cancel(Transaction& transaction) noexcept {
  auto& submitted = static_cast<TransactionImpl&>(transaction);
  RTSTDB_REQUIRE(&submitted.engine() == this, "Database::cancel",
                 "the transaction was made by another database");
  if (!submitted.ask_to_cancel()) return;
  cancels_asked_.fetch_add(1, std::memory_order_release);
  ring();
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
  give_job(job);
  job.wait();
  return std::move(job).take();
}

Result<std::vector<glm::vec3>> Engine::shape(GeometryId geometry, std::size_t positions,
                                             const ReadAt& read_at) {
  ShapeJob job(geometry, positions, read_at);
  give_job(job);
  job.wait();
  return std::move(job).take();
}

void Engine::call(const std::function<void()>& work) {
  CallJob job(work);
  give_job(job);
  job.wait();
}

void Engine::give_back(ReservationImpl& reservation) noexcept {
  const std::function<void()> work = [&] { reservations_.give_back(reservation); };
  CallJob job(work);
  take_job(job);  // its owner may have closed the database
  job.wait();
}

void Engine::carry_out(EngineJob& job) noexcept {
  give_job(job);
  job.wait();
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
  if (is_past_ && !declared.write_set().empty())
    return Error{ErrorCode::bad_input, "it writes, and nothing is written to the past"};
  if (clock_.is_virtual()) return {};
  Status status = Status::committed;
  call([&] { status = runner_.rehearse(declared); });
  const Outcome outcome = std::exchange(declared.draft(), Outcome{});
  if (status == Status::committed) return {};
  Outcome told = outcome;
  told.status = status;
  return Error{status == Status::device_lost ? ErrorCode::device_lost : ErrorCode::bad_input, describe(told)};
}

SchedulerCounts Engine::scheduler_counts() const {
  SchedulerCounts counts = accuracy_.read();
  counts.reservations = reservations_.counts();
  counts.restarts = restarts_.load(std::memory_order_relaxed);
  return counts;
}

void Engine::give_job(EngineJob& job) noexcept {
  const bool open = jobs_given_.push(job);
  RTSTDB_REQUIRE(open, "Database", "the database is closed (Database::close)");
  ring();
}

void Engine::close() noexcept {
  if (!thread_.joinable()) return;
  closing_.store(true, std::memory_order_release);
  ring();
  thread_.join();
  relief_bell_.ring();
  if (relief_.joinable()) relief_.join();
  if (log_ != nullptr) static_cast<void>(log_->close());
}

void Engine::ring() noexcept {
  bell_.ring();
  if (waits_for_device_.load(std::memory_order_seq_cst)) relief_bell_.ring();
}

void Engine::finish(TransactionImpl& transaction, Status status) noexcept {
  settle(transaction, status);
  const Terms terms = transaction.terms();
  tally_.ended(status, transaction.outcome(), terms);
  Reservations::given_back(transaction);
  const bool firm_commit = terms.deadline_class == DeadlineClass::firm &&
                           (status == Status::committed || status == Status::truncated);
  transaction.finish(status);  // from here on it may be gone
  if (firm_commit && clock_.now() > terms.deadline) tally_.handed_over_late();
}

void Engine::settle(TransactionImpl& transaction, Status status) noexcept {
  late_answers::settle(transaction, status, clock_);
  reservations_.ended(transaction, status);
}

void Engine::finish_cancelled(TransactionImpl& transaction, CancelledBy by) noexcept {
  transaction.draft().cancelled_by = by;
  finish(transaction, Status::cancelled);
}

// ---- the engine's thread

void Engine::run_thread() noexcept {
  working_.lock();
  while (!closing_.load(std::memory_order_acquire)) {
    const std::uint32_t heard = bell_.heard();
    if (!work_once()) sleep_unless_rung(heard);
  }
  cancel_all();
  working_.unlock();
}

bool Engine::work_once() noexcept {
  if (log_ != nullptr) log_->tend();
  if (executor_.lost()) {
    if (log_ != nullptr) log_->hand_over();
    revive_device();
  }
  receive();
  TransactionImpl* const most_urgent = queue_.pop();
  if (most_urgent != nullptr) carry_out_and_log(*most_urgent);
  if (most_urgent == nullptr && log_ != nullptr) log_->hand_over();
  const bool stepped = step_job();
  return most_urgent != nullptr || stepped;
}

void Engine::carry_out_and_log(TransactionImpl& transaction) noexcept {
  if (log_ == nullptr) return carry_out(transaction);
  // Not behind each commit: whoever waits for the next one's outcome would wait for this, too.
  if (!is_brief(transaction)) log_->hand_over();
  const Version before = store_.latest().version;
  carry_out(transaction);
  // Commits fill what is collected, so they are few; of others there may be any number.
  if (store_.latest().version == before) log_->hand_over();
}

void Engine::sleep_unless_rung(std::uint32_t heard) noexcept {
  if (!spin_before_sleep_.until(spin_, [&] { return bell_.heard() != heard; }))
    bell_.sleep_unless_rung(heard);
}

void Engine::carry_out(TransactionImpl& transaction) noexcept {
  if (transaction.is_to_be_cancelled()) return finish_cancelled(transaction, CancelledBy::caller);
  const Status status = runner_.run(transaction, this);
  if (status == Status::pending) return put_back(transaction);
  if (store_.latest().version != latest_.get().version) {
    if (listener_ != nullptr) listener_->committed(transaction.write_set());
    latest_.set(store_.latest());
  }
  end(transaction, status);
}

void Engine::end(TransactionImpl& transaction, Status status) noexcept {
  accuracy_.ended(transaction, status);
  if (!is_held(transaction, status)) return finish(transaction, status);
  settle(transaction, status);
  transaction.draft().status = status;
  log_->hold(transaction);
}

bool Engine::step_job() noexcept {
  if (jobs_ == nullptr) jobs_ = jobs_given_.take_all();
  if (jobs_ == nullptr) return false;
  auto& job = static_cast<EngineJob&>(*jobs_);
  if (log_ != nullptr) log_->hand_over();  // it may take long
  if (job.step(store_)) {
    jobs_ = job.next;
    job.mark_done();  // from here on it may be gone
  }
  return true;
}

void Engine::cancel_all() noexcept {
  for (HandOverLink* waiting = submitted_.close(); waiting != nullptr;) {
    HandOverLink* const next = waiting->next;
    finish_cancelled(static_cast<TransactionImpl&>(*waiting), CancelledBy::closing);
    waiting = next;
  }
  while (TransactionImpl* const waiting = queue_.pop())
    finish_cancelled(*waiting, CancelledBy::closing);
  while (step_job()) {
  }
  jobs_ = jobs_given_.close();
  while (jobs_ != nullptr)
    step_job();
}

}  // namespace rtstdb::transaction
