#pragma once
// What all prepared queries share: the base class, the policy for late answers, and where answers come from.
//
// Threads: a query belongs to one transaction at a time (query.hpp).

#include <cstdint>

#include <rtstdb/entity.hpp>

namespace rtstdb {

/// What a query's answers are when its transaction does not complete in time. The queries of one transaction
/// may have different policies.
enum class LatePolicy : std::uint8_t {
  /// Answers only of completed transactions (Outcome::done), late ones included; otherwise none.
  discard,
  /// As discard, and if a transaction does not complete, for whatever reason, the answers of the last
  /// completed one remain: Outcome::stale is set, and answer_info() tells their age. Needs twice the memory
  /// for answers.
  last_good,
  /// In a transaction without writes: the elements answered by the deadline. When only queries with this
  /// policy are left to execute and the next chunk would pass the deadline, the transaction ends, whatever
  /// its class: it completes as truncated (Outcome::partial). A firm transaction that passes its deadline
  /// nevertheless, or has other queries left, is missed; the elements answered by then keep their answers,
  /// and so do long searches that completed during it. Queries are executed in the order in which they were
  /// added. Elements without an answer are marked incomplete. The deadline is checked between chunks
  /// (DatabaseOptions::chunk): a batch that is not split is answered whole or not at all. Has no effect under
  /// a virtual clock. In a transaction with writes it acts as discard, since no version exists that the
  /// answers could belong to. Contact and impact queries answer all elements of a batch at its end: they
  /// act as discard as well.
  partial,
};

/// Which transaction the answers in a query's spans come from.
struct AnswerInfo {
  std::uint32_t elements = 0;  ///< number of elements with answers in the spans; 0: none
  std::uint32_t missing = 0;   ///< those among them that are marked incomplete
  Version version = 0;         ///< the version that was queried
  WorldTime version_time{};
  ClockTime published{};  ///< when the answers were published; zero if the transaction was missed
  /// LatePolicy::last_good: the last transaction did not complete; the answers are of an earlier one.
  bool stale = false;
  Nanoseconds age{0};  ///< stale: from `published` to the end of the last transaction
};

/// Base of all prepared queries. Made by Database::prepare.
class Query {
 public:
  virtual ~Query() = default;
  /// Valid from the outcome of a transaction with the query until the query is submitted again.
  virtual const AnswerInfo& answer_info() const noexcept = 0;
};

const char* to_string(LatePolicy policy) noexcept;

}  // namespace rtstdb
