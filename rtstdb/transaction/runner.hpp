#pragma once
// Carries out one transaction: preconditions, writes, queries, publishing. The engine's thread alone.
//
// When does a transaction commit, and when is it late? Only who holds the engine's lock reads rows, so a
// version is readable by every later transaction and snapshot from the moment Store::publish has run. The
// clock is read after that: `published`. If a firm deadline has passed by this reading, the version is taken
// back before anything else could have read it, and the transaction is missed. So a firm commit was readable
// before its deadline by a reading taken afterwards, whatever the operating system did to the thread in
// between. latest() and the transaction's status follow `published` within stores and wake-up; a status that
// reaches its owner after the deadline all the same is counted as firm_handed_over_late.

#include <array>
#include <cstddef>
#include <optional>
#include <span>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/store/store.hpp"
#include "rtstdb/transaction/commit_log.hpp"
#include "rtstdb/scheduler/cost_model.hpp"
#include "rtstdb/transaction/running.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

class Runner {
 public:
  /// `chunk`: how long an urgent transaction may wait for one that asks; zero: nothing is divided.
  /// `log`: null, nothing is recorded.
  Runner(store::Store& store, query::Executor& executor, const Clock& clock, scheduler::CostModel& costs,
         Nanoseconds chunk, CommitLog* log = nullptr)
      : store_(store), executor_(executor), clock_(clock), costs_(costs), chunk_(chunk), log_(log) {}

  /// Fills the transaction's outcome and returns its status, pending when it gave way (Running); does not give the transaction back. In its waits and gaps
  /// `callbacks` is served and may run others by this: those that fits_beside says yes to.
  Status run(TransactionImpl& transaction, query::ExecutorCallbacks* callbacks) noexcept;
  /// Carries out parts of a transaction and all of it, each as often as it takes to know what it costs, and leaves nothing of
  /// it. Committed, or why it can not be done.
  Status rehearse(TransactionImpl& transaction) noexcept;
  /// Whether this could be carried out now: no second one can be staged, and what others read stays readable.
  bool fits_beside(const TransactionImpl& transaction) const noexcept;
  RunningStack& running() noexcept { return running_; }
  const RunningStack& running() const noexcept { return running_; }

 private:
  Status rehearse_once(TransactionImpl& transaction) noexcept;
  Status write(TransactionImpl& transaction, Running& running, query::ExecutorCallbacks* callbacks) noexcept;
  /// Sync mode (logging.cpp): what is staged is published when it is on disk.
  Status write_through(TransactionImpl& transaction, const Running& running,
                       const store::RowSource& version) noexcept;
  Status read(TransactionImpl& transaction, Running& running, query::ExecutorCallbacks* callbacks) noexcept;
  static bool expectations_hold(TransactionImpl& transaction, const store::RowSource& rows) noexcept;
  /// The status with which the transaction fails; none when its answers stand.
  std::optional<Status> answer(TransactionImpl& transaction, Running& running, const store::RowSource& rows,
                               query::ExecutorCallbacks* callbacks) noexcept;
  /// Into halves of a chunk, what takes longer than a whole one.
  void divide(TransactionImpl& transaction) const noexcept;
  static Status cancelled(TransactionImpl& transaction) noexcept;
  /// Why a run was given up in a gap.
  Status stopped(TransactionImpl& transaction, const Running& running) noexcept;
  static std::optional<BadInput> check_queries(TransactionImpl& transaction, const store::RowSource& rows,
                                               store::TimeSpan& times) noexcept;
  /// Refuses a batch whose times span more than max_query_window_ns.
  static std::optional<BadInput> check_window(const store::TimeSpan& times) noexcept;
  /// Reads the clock, notes the cost and sets `published`. False: a firm deadline has passed, `published`
  /// stays unset.
  bool published_in_time(TransactionImpl& transaction, const Running& running) noexcept;
  static bool is_in_time(TransactionImpl& transaction, ClockTime now) noexcept;
  void learn_queries(TransactionImpl& transaction, const Running& running) noexcept;
  /// Reads the clock.
  ClockTime note_cost(TransactionImpl& transaction, const Running& running) noexcept;
  Status done(TransactionImpl& transaction, const store::RowSource& rows) noexcept;

  store::Store& store_;
  query::Executor& executor_;
  const Clock& clock_;
  scheduler::CostModel& costs_;
  Nanoseconds chunk_;
  CommitLog* log_;
  RunningStack running_;
};

}  // namespace rtstdb::transaction
