#pragma once
// Executes the reads and queries of one transaction on one version, and updates the cost model by
// what they took.
//
// Threads: the thread that holds the engine's lock; the executor releases it in its waits
// (ExecutorCallbacks).

#include <optional>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/cost_model.hpp"
#include "rtstdb/scheduler/run_stack.hpp"
#include "rtstdb/store/row_source.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

/// What the queries of one execution took, and which structures they needed.
struct QueryCost {
  Nanoseconds time{0};
  query::StructureWork structures;
};

class QueryExecution {
 public:
  /// All of these outlive it. `chunk`: see DatabaseOptions; zero: batches are not divided.
  QueryExecution(query::Executor& executor, const Clock& clock, scheduler::CostModel& costs,
                 Nanoseconds chunk) noexcept
      : executor_(executor), clock_(clock), costs_(costs), chunk_(chunk) {}

  /// Answers the reads and the queries of the transaction, and fills its outcome. None: they are answered,
  /// all or (partial) some. Else the status with which the transaction fails; `pending` when it must restart.
  /// Calls `callbacks`, which may be null, as query::Executor says. Sets `cost`.
  std::optional<Status> execute(TransactionImpl& transaction, const scheduler::Run& run,
                                const store::RowSource& rows, query::ExecutorCallbacks* callbacks,
                                QueryCost& cost) noexcept;
  /// Updates the cost model. After an execution that answered.
  void update_costs(TransactionImpl& transaction, const QueryCost& cost) noexcept;

 private:
  /// Sets the times of the requests, and `times` to the span of all. A result names what is wrong.
  static std::optional<BadInput> check(TransactionImpl& transaction, const store::RowSource& rows,
                                       store::TimeSpan& times) noexcept;
  void divide(TransactionImpl& transaction) const noexcept;
  /// The status of a transaction whose run was stopped at a preemption point.
  Status stopped(TransactionImpl& transaction, const scheduler::Run& run, const QueryCost& cost) noexcept;

  query::Executor& executor_;
  const Clock& clock_;
  scheduler::CostModel& costs_;
  const Nanoseconds chunk_;
};

}  // namespace rtstdb::transaction
