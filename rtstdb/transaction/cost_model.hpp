#pragma once
// What work costs, learned from what it cost: per kind of query, for the rows of a transaction, and for the
// positions of its shapes, a running fit of cost = a + b * count in which old samples fade. One thread; no
// allocation.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include <rtstdb/time.hpp>

#include "rtstdb/query/executor.hpp"
#include "rtstdb/store/write_set.hpp"

namespace rtstdb::transaction {

/// A weighted least-squares line that never falls and never goes below zero.
class CostLine {
 public:
  void learn(double count, double cost_ns) noexcept;
  /// Zero before the first sample. Where only one count was ever seen, more is taken to cost in proportion
  /// and less to cost the same.
  double predict_ns(double count) const noexcept;
  /// What one more costs, where there are so many; zero before the first sample.
  double per_element_ns(double count) const noexcept;
  std::uint64_t samples() const noexcept { return samples_; }

 private:
  struct Line {
    double base_ns = 0.0, slope_ns = 0.0;
  };
  /// None while all samples have about the same count.
  std::optional<Line> fitted() const noexcept;

  double weight_ = 0.0, counts_ = 0.0, costs_ = 0.0, counts_squared_ = 0.0, counts_costs_ = 0.0;
  std::uint64_t samples_ = 0;
};

class CostModel {
 public:
  /// Below this many samples of a kind nothing is predicted for it.
  static constexpr std::uint64_t samples_needed = 16;

  /// None while a kind that takes part has too few samples.
  std::optional<Nanoseconds> predict(const store::WriteSet& writes,
                                     std::span<const query::Request> requests) const noexcept;

  /// As many elements as take so long, one at least, where the request has its count.
  std::uint32_t elements_in(const query::Request& request, Nanoseconds time) const noexcept;

  /// A transaction with those writes took so long, its queries not counted. Bringing a shape to the device is part of
  /// the queries that want it.
  void learn_writes(const store::WriteSet& writes, Nanoseconds cost) noexcept;
  /// One run of the executor. With several requests the cost is split in the proportion of the predictions.
  void learn_queries(std::span<const query::Request> requests, Nanoseconds cost) noexcept;

 private:
  const CostLine& line(const query::Request& request) const noexcept {
    return queries_[static_cast<std::size_t>(request.query->kind())];
  }

  CostLine writes_;
  CostLine positions_;  // beside the rows of the same transaction
  std::array<CostLine, static_cast<std::size_t>(query::QueryKind::count)> queries_;
};

}  // namespace rtstdb::transaction
