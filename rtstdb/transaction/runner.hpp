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
//
// One transaction is one Executor::run. Small transactions that are ready together could share one: this is
// where.

#include <optional>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/store/store.hpp"
#include "rtstdb/transaction/cost_model.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

class Runner {
 public:
  Runner(store::Store& store, query::Executor& executor, const Clock& clock, CostModel& costs)
      : store_(store), executor_(executor), clock_(clock), costs_(costs) {}

  /// Fills the transaction's outcome and returns its status; does not give the transaction back. While a
  /// transaction that only reads waits for the device, `meanwhile` is served and may run others that only
  /// write: the version being read stays.
  Status run(TransactionImpl& transaction, query::Meanwhile* meanwhile) noexcept;
  /// The version that a transaction under way reads, which commits made meanwhile have to leave readable.
  std::optional<Version> reading() const noexcept { return reading_; }

 private:
  Status write(TransactionImpl& transaction) noexcept;
  Status read(TransactionImpl& transaction, query::Meanwhile* meanwhile) noexcept;
  static bool expectations_hold(TransactionImpl& transaction, const query::RowSource& rows) noexcept;
  /// The status with which the transaction fails; none when its answers stand.
  std::optional<Status> answer(TransactionImpl& transaction, const query::RowSource& rows,
                               query::Meanwhile* meanwhile) noexcept;
  static std::optional<BadInput> check_queries(TransactionImpl& transaction, const query::RowSource& rows,
                                               query::TimeSpan& times) noexcept;
  /// Reads the clock, notes the cost and sets `published`. False: a firm deadline has passed, `published`
  /// stays unset.
  bool published_in_time(TransactionImpl& transaction) noexcept;
  Status done(TransactionImpl& transaction, const query::RowSource& rows) noexcept;

  store::Store& store_;
  query::Executor& executor_;
  const Clock& clock_;
  CostModel& costs_;
  Nanoseconds queries_cost_{0};  ///< of the transaction being run
  std::optional<Version> reading_;
};

}  // namespace rtstdb::transaction
