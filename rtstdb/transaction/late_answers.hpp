#pragma once
// What is left to the caller of the answers of a transaction, as the late policies of its queries say: decided in the gaps
// of its run, and when it is given back. Whoever holds the engine's lock, but for `settle`.

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/transaction/running.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction::late_answers {

/// In a gap, before others run in it: notes which answers were there by the deadline.
void note_gap(Running& running, const Clock& clock) noexcept;
/// In a gap, after others have run: whether another chunk would pass the deadline of a transaction that has only queries
/// left whose answers may be partial.
bool are_enough(Running& running, const Clock& clock) noexcept;
/// The transaction has its status and is about to be given back: its queries' answers stand or fall.
void settle(TransactionImpl& transaction, Status status, const Clock& clock) noexcept;

}  // namespace rtstdb::transaction::late_answers
