#pragma once
// The late policies of queries: which answers the owner of a transaction gets when its deadline passes.
// Decided at the preemption points of its run and when it is given back.
//
// Threads: the thread that holds the engine's lock.

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/run_stack.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction::late_answers {

/// At the begin of a preemption point: notes which answers exist while the deadline has not passed.
void begin_point(scheduler::Run& run, const Clock& clock) noexcept;
/// At the end of a preemption point. True: another chunk would pass the deadline, and all queries that are
/// not complete may be answered in part, so that the run should end with what is in flight.
bool ends_in_time(scheduler::Run& run, const Clock& clock) noexcept;
/// The transaction has this status and is about to be given back: publishes or discards the answers of each
/// query.
void settle(TransactionImpl& transaction, Status status, const Clock& clock) noexcept;

}  // namespace rtstdb::transaction::late_answers
