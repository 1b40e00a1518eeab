#pragma once
// Executes one transaction: preconditions, writes, queries, commit.
//
//   writes   stage -> queries on the staged version -> publish -> in time? -> record in the log
//            -> complete_commit
//                  \-> failed or late: discard
//   reads    the version that its terms name -> queries -> in time?
//   sync     stage -> queries -> on disk? -> publish -> in time? -> complete_commit
//                  \-> failed or late: discard, in the log too
//
// When a firm transaction counts as in time: only who holds the engine's lock reads rows, so a version is
// readable by every later transaction and snapshot as soon as Store::publish has run. The clock is read after
// that (`published`). If the firm deadline has passed by this reading, the version is discarded before
// anything could read it, and the transaction is missed. So a firm commit was readable before its deadline by
// a reading taken afterwards, whatever the operating system did to the thread in between. The owner sees the
// status after a wake-up; a status that is seen after the deadline is counted (firm_delivered_late).
//
// Threads: the thread that holds the engine's lock.

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/cost_model.hpp"
#include "rtstdb/scheduler/preemption.hpp"
#include "rtstdb/store/store.hpp"
#include "rtstdb/transaction/commit_log.hpp"
#include "rtstdb/transaction/query_execution.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

/// What the commit path works with; all of it outlives the path.
struct CommitParts {
  store::Store& store;
  QueryExecution& queries;
  scheduler::RunStack& runs;
  scheduler::CostModel& costs;
  const Clock& clock;
  CommitLog* log;  ///< null: commits are not recorded
};

class CommitPath {
 public:
  explicit CommitPath(const CommitParts& parts) noexcept : parts_(parts) {}

  /// Fills the transaction's outcome and returns its status; `pending`: it must restart. The transaction is
  /// not given back. Others may be executed by this path inside `callbacks`, those that
  /// Preemption::can_execute accepts.
  Status execute(TransactionImpl& transaction, query::ExecutorCallbacks* callbacks) noexcept;

  /// Executes the transaction without publishing anything, parts of it and all of it, as often as the cost
  /// model needs. Committed, or the status that says why it can not be executed; then the outcome says more.
  /// See Database::calibrate.
  Status calibrate(TransactionImpl& transaction) noexcept;

 private:
  Status write(TransactionImpl& transaction, scheduler::Run& run,
               query::ExecutorCallbacks* callbacks) noexcept;
  Status read(TransactionImpl& transaction, scheduler::Run& run,
              query::ExecutorCallbacks* callbacks) noexcept;
  Status publish(TransactionImpl& transaction, const scheduler::Run& run, const QueryCost& cost,
                 const store::RowSource& version) noexcept;
  /// Sync mode: publishes once the write set is on disk.
  Status publish_durably(TransactionImpl& transaction, const scheduler::Run& run, const QueryCost& cost,
                         const store::RowSource& version) noexcept;
  Status execute_unpublished(TransactionImpl& transaction) noexcept;
  static bool preconditions_hold(TransactionImpl& transaction, const store::RowSource& rows) noexcept;
  /// Reads the clock, notes the cost and updates the cost model.
  ClockTime note_cost(TransactionImpl& transaction, const scheduler::Run& run,
                      const QueryCost& cost) noexcept;
  /// Notes the cost and sets `published`. False: a firm deadline has passed, and `published` stays unset.
  bool published_in_time(TransactionImpl& transaction, const scheduler::Run& run,
                         const QueryCost& cost) noexcept;
  /// The status of a transaction that was published.
  static Status done(TransactionImpl& transaction, const store::RowSource& rows) noexcept;

  const CommitParts parts_;
};

}  // namespace rtstdb::transaction
