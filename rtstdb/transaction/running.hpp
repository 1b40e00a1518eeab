#pragma once
// The transactions that are being carried out: one, those that stand interrupted in its way down, and on top of them at
// most one write of the relief. Whoever holds the engine's lock.

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include <rtstdb/result.hpp>
#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

struct Running {
  TransactionImpl* transaction = nullptr;
  std::optional<Version> reading;            ///< the version it reads, which commits have to leave readable
  bool staged = false;                       ///< its writes are: nobody else's can be
  Nanoseconds queries_cost{0};               ///< of that, interruptions are no part
  query::StructureWork structures;
  std::optional<ClockTime> preempted_at;  ///< when it was interrupted; none while it gets on
  Nanoseconds awaited_for{0};             ///< so long before that somebody waited for it
  /// Spent on others in its gaps, and until the device was done with the one whose gap this is.
  Nanoseconds interrupted{0};
  Nanoseconds device_time_while_preempted{0};  ///< so long the device was busy with it while it stood
  bool must_restart = false;                   ///< it stops to be begun anew
  // Where answers may be partial.
  std::optional<ClockTime> last_gap;  ///< when others had run in it
  Nanoseconds chunk{0};               ///< from the gap before to this one
};

class RunningStack {
 public:
  Running& push(TransactionImpl& transaction) noexcept {
    RTSTDB_ASSERT(count_ < entries_.size());
    entries_[count_] = {};
    entries_[count_].transaction = &transaction;
    return entries_[count_++];
  }
  void pop() noexcept { --count_; }
  bool empty() const noexcept { return count_ == 0; }
  std::uint32_t depth() const noexcept { return count_; }
  /// Misuse when empty.
  Running& innermost() noexcept { return entries_[count_ - 1]; }
  /// In whose gap the innermost runs, or null.
  Running* around() noexcept { return count_ > 1 ? &entries_[count_ - 2] : nullptr; }
  std::span<const Running> all() const noexcept { return std::span(entries_).first(count_); }
  bool one_is_staged() const noexcept { return std::ranges::any_of(all(), &Running::staged); }

 private:
  std::array<Running, query::max_nesting + 2> entries_{};
  std::uint32_t count_ = 0;
};

}  // namespace rtstdb::transaction
