#pragma once
// What was predicted beside what it came to: costs by kind of query, and promises of admission. Written under the engine's
// lock, read by any thread; no allocation but in read.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <rtstdb/database.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/transaction/transaction_impl.hpp"

namespace rtstdb::transaction {

class Accuracy {
 public:
  /// The transaction has this outcome and is about to be given back.
  void ended(const TransactionImpl& transaction, Status status) noexcept;
  SchedulerCounts read() const;

 private:
  using Counter = std::atomic<std::uint64_t>;
  static constexpr std::size_t kinds = static_cast<std::size_t>(query::QueryKind::count);
  /// Ratios from 2^-8 to 2^8, sixteen to an octave.
  static constexpr int per_octave = 16;
  static constexpr int octaves = 8;
  static constexpr std::size_t buckets = 2 * octaves * per_octave + 1;
  using Histogram = std::array<Counter, buckets>;

  static CostPredictions read(query::QueryKind kind, const Histogram& histogram);

  std::array<Histogram, kinds> predicted_over_actual_{};
  Counter promised_{0}, kept_{0}, outranked_{0};
};

}  // namespace rtstdb::transaction
