#include "rtstdb/transaction/cost_model.hpp"

#include <algorithm>
#include <cmath>

namespace rtstdb::transaction {

namespace {

/// A sample's weight halves every 34 samples after it.
constexpr double fading = 0.98;

/// Take between a tenth of a millisecond and a few on any device.
constexpr std::uint32_t elements_unmeasured = 4096;

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

std::optional<CostLine::Line> CostLine::fitted() const noexcept {
  if (samples_ == 0) return std::nullopt;
  const double mean_count = counts_ / weight_;
  const double mean_cost = costs_ / weight_;
  const double variance = counts_squared_ / weight_ - mean_count * mean_count;
  if (variance <= 1e-6 * std::max(1.0, mean_count * mean_count)) return std::nullopt;
  const double slope = std::max(0.0, (counts_costs_ / weight_ - mean_count * mean_cost) / variance);
  const double base = mean_cost - slope * mean_count;
  if (base < 0.0) return Line{0.0, counts_costs_ / counts_squared_};
  return Line{base, slope};
}

double CostLine::predict_ns(double count) const noexcept {
  if (samples_ == 0) return 0.0;
  if (const auto line = fitted()) return line->base_ns + line->slope_ns * count;
  return costs_ / weight_ * (counts_ > 0.0 ? std::max(1.0, count * weight_ / counts_) : 1.0);
}

double CostLine::per_element_ns(double count) const noexcept {
  if (const auto line = fitted()) return line->slope_ns;
  return count > 0.0 ? predict_ns(count) / count : 0.0;
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

std::uint32_t CostModel::elements_in(const query::Request& request, Nanoseconds time) const noexcept {
  const CostLine& costs = line(request);
  const double per_element_ns = costs.per_element_ns(request.count);
  if (costs.samples() == 0 || per_element_ns <= 0.0) return elements_unmeasured;
  const double elements = static_cast<double>(time.count()) / per_element_ns;
  return static_cast<std::uint32_t>(std::clamp(elements, 1.0, 1e9));
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
