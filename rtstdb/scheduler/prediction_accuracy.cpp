#include "rtstdb/scheduler/prediction_accuracy.hpp"

#include <algorithm>
#include <cmath>

namespace rtstdb::scheduler {
namespace {

void increment(std::atomic<std::uint64_t>& counter) noexcept {
  counter.fetch_add(1, std::memory_order_relaxed);
}

}  // namespace

void PredictionAccuracy::ended(const ScheduledTransaction& transaction, Status status) noexcept {
  const Outcome& outcome = transaction.outcome();
  const bool done = is_done(status);
  if (transaction.promised && (done || status == Status::missed)) {
    increment(promised_);
    if (done) {
      increment(kept_);
    } else if (transaction.slack < Nanoseconds(0)) {
      increment(outranked_);
    }
  }
  if (!done || outcome.partial || outcome.predicted_cost.count() <= 0 || outcome.actual_cost.count() <= 0)
    return;
  const double octaves_above = std::log2(static_cast<double>(outcome.predicted_cost.count()) /
                                         static_cast<double>(outcome.actual_cost.count()));
  const double bucket =
      std::round((std::clamp<double>(octaves_above, -octaves, octaves) + octaves) * per_octave);
  for (const query::Request& request : transaction.requests())
    increment(predicted_over_actual_[static_cast<std::size_t>(request.query->cost_class())]
                                    [static_cast<std::size_t>(bucket)]);
}

CostPredictions PredictionAccuracy::read(query::CostClass cost_class, const Histogram& histogram) {
  std::array<std::uint64_t, buckets> counts{};
  CostPredictions found{.cost_class = query::to_string(cost_class)};
  for (std::size_t k = 0; k < buckets; ++k)
    found.count += counts[k] = histogram[k].load(std::memory_order_relaxed);
  const auto quantile = [&](double share) {
    const double wanted = share * static_cast<double>(found.count);
    std::uint64_t passed = 0;
    std::size_t k = 0;
    while (k + 1 < buckets && static_cast<double>(passed += counts[k]) < wanted)
      ++k;
    return std::exp2(static_cast<double>(k) / per_octave - octaves);
  };
  found.p01 = quantile(0.01);
  found.median = quantile(0.5);
  found.p99 = quantile(0.99);
  return found;
}

SchedulerCounts PredictionAccuracy::read() const {
  SchedulerCounts counts;
  for (std::size_t k = 0; k < cost_classes; ++k) {
    const CostPredictions found = read(static_cast<query::CostClass>(k), predicted_over_actual_[k]);
    if (found.count > 0) counts.predictions.push_back(found);
  }
  counts.promised = promised_.load(std::memory_order_relaxed);
  counts.kept = kept_.load(std::memory_order_relaxed);
  counts.outranked = outranked_.load(std::memory_order_relaxed);
  return counts;
}

}  // namespace rtstdb::scheduler
