// The log's thread, and what it does: drives the writer, gives back what is held, and ends the log.

#include <algorithm>
#include <chrono>
#include <new>
#include <utility>

#include "rtstdb/transaction/commit_log.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {
namespace {

/// How often the thread looks whether the engine has made its copy, or the disk takes what it has to take.
constexpr Nanoseconds look_again_after{1'000'000};

std::int64_t real_time_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<Nanoseconds>(now).count();
}

TransactionImpl& transaction_of(HandOverLink& link) {
  return static_cast<TransactionImpl&>(link);
}

}  // namespace

void CommitLog::run_thread() noexcept {
  while (!closing_.load(std::memory_order_acquire)) {
    const LogBell::Heard heard = bell_.hear();
    const log::Writer::Step step = work();
    if (!step.worked) nap(heard, step);
  }
  end_log();
}

log::Writer::Step CommitLog::work() noexcept {
  const log::Writer::Step step = writer_->step(real_time_ns());
  tell_progress();
  give_back_held();
  if (in_gap_.load(std::memory_order_acquire) && ring_.used() <= ring_.capacity() / 2)
    owner_->tend_log_soon();
  return step;
}

void CommitLog::nap(LogBell::Heard heard, const log::Writer::Step& step) noexcept {
  const bool looks = world_copy_.under_way() || in_gap_.load(std::memory_order_acquire);
  if (step.wake_at == ClockTime::max() && !looks) return bell_.sleep(heard);
  const ClockTime now = clock_.now();
  const Nanoseconds at_most = looks || step.wake_at <= now ? look_again_after : step.wake_at - now;
  // What is to be tried again, a checkpoint, may be far off: the next commit does not wait for that.
  if (!looks && !step.has_records) return bell_.sleep(heard, at_most);
  bell_.doze(heard, at_most);
}

void CommitLog::tell_progress() noexcept {
  const Told now{writer_->durable(), writer_->records_on_disk(), writer_->last_write_failed(),
                 writer_->waits_for_checkpoint()};
  if (now == told_) return;
  told_ = now;
  // Pairs with the waits: either they see the new number or the waiter is seen here.
  progress_.fetch_add(1, std::memory_order_seq_cst);
  if (waiters_.load(std::memory_order_seq_cst) != 0) threads::futex_wake_all(&progress_);
}

// ---- what is held, by ascending version

void CommitLog::give_back_held() noexcept {
  *held_end_ = held_given_.take_all();
  while (*held_end_ != nullptr)
    held_end_ = &(*held_end_)->next;
  while (held_ != nullptr) {
    const bool durable = transaction_of(*held_).outcome().version <= told_.durable;
    if (!durable && !told_.refused) return;
    HandOverLink& first = *std::exchange(held_, held_->next);
    if (held_ == nullptr) held_end_ = &held_;
    held_count_.fetch_sub(1, std::memory_order_release);
    give_back(transaction_of(first), durable);
  }
}

void CommitLog::give_back(TransactionImpl& transaction, bool durable) noexcept {
  transaction.draft().durable = durable;
  if (durable) transaction.draft().durable_at = deadline_clock_->now();
  owner_->give_back_held(transaction);
}

// ---- the end

void CommitLog::end_log() noexcept {
  // The engine's thread has ended, and its side of the ring is this thread's.
  recorder_.flush();
  try {
    closed_ = close_writer();
  } catch (const std::bad_alloc&) {
    closed_ = Error{ErrorCode::file, "out of memory"};  // short enough to need none
  }
  tell_progress();
  told_.refused = true;  // what is held still waits in vain
  give_back_held();
}

Result<void> CommitLog::close_writer() {
  while (recorder_.in_gap() && !writer_->last_write_failed()) {
    writer_->flush_soon();
    writer_->step(real_time_ns());
    recorder_.maintain();
  }
  if (recorder_.in_gap())
    return Error{ErrorCode::file, "the log ends before the last commits: " + state().last_fault};
  return writer_->close(real_time_ns());
}

}  // namespace rtstdb::transaction
