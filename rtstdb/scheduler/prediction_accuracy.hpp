#pragma once
// How good predictions were: predicted over actual costs by cost class, and which promises of admission
// were kept.
//
// Threads: ended by the thread that holds the engine's lock, read by any. Only read allocates.

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

#include <rtstdb/database.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/scheduler/scheduled_transaction.hpp"

namespace rtstdb::scheduler {

class PredictionAccuracy {
 public:
  /// The transaction was executed and has this outcome.
  void ended(const ScheduledTransaction& transaction, Status status) noexcept;
  /// The predictions and promises; the other members of SchedulerCounts stay empty.
  SchedulerCounts read() const;

 private:
  using Counter = std::atomic<std::uint64_t>;
  static constexpr std::size_t cost_classes = static_cast<std::size_t>(query::CostClass::count);
  /// A logarithmic histogram of ratios from 2^-8 to 2^8.
  static constexpr int per_octave = 16;
  static constexpr int octaves = 8;
  static constexpr std::size_t buckets = 2 * octaves * per_octave + 1;
  using Histogram = std::array<Counter, buckets>;

  static CostPredictions read(query::CostClass cost_class, const Histogram& histogram);

  std::array<Histogram, cost_classes> predicted_over_actual_{};
  Counter promised_{0}, kept_{0}, outranked_{0};
};

}  // namespace rtstdb::scheduler
