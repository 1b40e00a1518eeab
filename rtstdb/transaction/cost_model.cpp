#include "rtstdb/transaction/cost_model.hpp"

#include <algorithm>
#include <cmath>

namespace rtstdb::transaction {

namespace {

/// A sample's weight halves every 34 samples after it.
constexpr double fading = 0.98;

double positions_of(const store::WriteSet& writes) noexcept {
  double sum = 0.0;
  for (const store::ShapeWrite& shape : writes.shapes)
    sum += static_cast<double>(shape.given);
  return sum;
}

}  // namespace

void CostLine::learn(double count, double cost_ns) noexcept {
  weight_ = weight_ * fading + 1.0;
  counts_ = counts_ * fading + count;
  costs_ = costs_ * fading + cost_ns;
  counts_squared_ = counts_squared_ * fading + count * count;
  counts_costs_ = counts_costs_ * fading + count * cost_ns;
  ++samples_;
}

double CostLine::predict_ns(double count) const noexcept {
  if (samples_ == 0) return 0.0;
  const double mean_count = counts_ / weight_;
  const double mean_cost = costs_ / weight_;
  const double variance = counts_squared_ / weight_ - mean_count * mean_count;
  if (variance <= 1e-6 * std::max(1.0, mean_count * mean_count)) {
    return mean_cost * (mean_count > 0.0 ? std::max(1.0, count / mean_count) : 1.0);
  }
  double slope = std::max(0.0, (counts_costs_ / weight_ - mean_count * mean_cost) / variance);
  double base = mean_cost - slope * mean_count;
  if (base < 0.0) {
    base = 0.0;
    slope = counts_costs_ / counts_squared_;
  }
  return base + slope * count;
}

std::optional<Nanoseconds> CostModel::predict(const store::WriteSet& writes,
                                              std::span<const query::Request> requests) const noexcept {
  if (writes_.samples() < samples_needed) return std::nullopt;
  double sum_ns = writes_.predict_ns(static_cast<double>(writes.writes.size()));
  if (!writes.shapes.empty()) {
    if (positions_.samples() < samples_needed) return std::nullopt;
    sum_ns += positions_.predict_ns(positions_of(writes));
  }
  for (const query::Request& request : requests) {
    if (line(request).samples() < samples_needed) return std::nullopt;
    sum_ns += line(request).predict_ns(request.count);
  }
  return Nanoseconds(std::llround(sum_ns));
}

void CostModel::learn_writes(const store::WriteSet& writes, Nanoseconds cost) noexcept {
  const auto rows = static_cast<double>(writes.writes.size());
  const auto cost_ns = static_cast<double>(cost.count());
  if (writes.shapes.empty()) {
    writes_.learn(rows, cost_ns);
  } else {
    positions_.learn(positions_of(writes), std::max(0.0, cost_ns - writes_.predict_ns(rows)));
  }
}

void CostModel::learn_queries(std::span<const query::Request> requests, Nanoseconds cost) noexcept {
  double predicted_ns = 0.0;
  for (const query::Request& request : requests)
    predicted_ns += line(request).predict_ns(request.count);
  const double equal_share = 1.0 / static_cast<double>(requests.size());
  std::array<double, static_cast<std::size_t>(query::QueryKind::count)> shares{};
  std::array<double, shares.size()> counts{};
  std::array<double, shares.size()> requests_of_kind{};
  for (const query::Request& request : requests) {
    const auto kind = static_cast<std::size_t>(request.query->kind());
    shares[kind] += predicted_ns > 0.0 ? line(request).predict_ns(request.count) / predicted_ns : equal_share;
    counts[kind] += request.count;
    requests_of_kind[kind] += 1.0;
  }
  for (std::size_t kind = 0; kind < shares.size(); ++kind) {
    if (requests_of_kind[kind] == 0.0) continue;
    queries_[kind].learn(counts[kind] / requests_of_kind[kind],
                         static_cast<double>(cost.count()) * shares[kind] / requests_of_kind[kind]);
  }
}

}  // namespace rtstdb::transaction
