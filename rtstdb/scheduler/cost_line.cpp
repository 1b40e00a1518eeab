#include "rtstdb/scheduler/cost_line.hpp"

#include <algorithm>

namespace rtstdb::scheduler {
namespace {

/// The weight of a sample halves within 34 samples.
constexpr double decay = 0.98;

/// The excess of a sample halves within 693 samples: rare events have to be remembered to keep 999 promises
/// of 1,000.
constexpr double above_decay = 0.999;

/// The excess of expensive elements halves within 44 samples: they may be rare.
constexpr double worst_decay = 1.0 - 1.0 / 64.0;

/// The largest of the samples seen is smaller than the largest to come.
constexpr double safety_factor = 1.25;

}  // namespace

bool CostLine::fit(Line& line) const noexcept {
  if (samples_ == 0) return false;
  const double mean_count = counts_ / weight_;
  const double mean_cost = costs_ / weight_;
  const double variance = counts_squared_ / weight_ - mean_count * mean_count;
  if (variance <= 1e-6 * std::max(1.0, mean_count * mean_count)) return false;
  const double slope = std::max(0.0, (counts_costs_ / weight_ - mean_count * mean_cost) / variance);
  const double base = mean_cost - slope * mean_count;
  line = base < 0.0 ? Line{0.0, counts_costs_ / counts_squared_} : Line{base, slope};
  return true;
}

/// The second outlier in a row on the same side says that costs have changed; a single one is an accident.
bool CostLine::costs_have_changed(double ratio) noexcept {
  const int side = ratio > max_above ? 1 : ratio < 1.0 / max_above ? -1 : 0;
  outliers_in_a_row_ = side * outliers_in_a_row_ > 0 ? outliers_in_a_row_ + side : side;
  return outliers_in_a_row_ * side > 1;
}

void CostLine::update(double count, double cost_ns) noexcept {
  const double expected_ns = predict_ns(count);
  double kept = decay;
  above_ = 1.0 + (above_ - 1.0) * above_decay;
  if (expected_ns > 0.0 && costs_have_changed(cost_ns / expected_ns)) {
    // All earlier samples together weigh as much as this one. If they were cheaper, their excess is no
    // measure any more.
    kept = std::min(decay, 1.0 / weight_);
    if (outliers_in_a_row_ > 0) above_ = 1.0 + (above_ - 1.0) / 2.0;
  } else if (expected_ns > 0.0) {
    above_ = std::max(above_, std::min(cost_ns / expected_ns, max_above));
  }
  weight_ = weight_ * kept + 1.0;
  counts_ = counts_ * kept + count;
  costs_ = costs_ * kept + cost_ns;
  counts_squared_ = counts_squared_ * kept + count * count;
  counts_costs_ = counts_costs_ * kept + count * cost_ns;
  ++samples_;
}

void CostLine::update_from_worst_element(double count, double element_cost_ns) noexcept {
  const double mean_ns = element_ns(count);
  worst_element_ns_ = mean_ns + std::max(worst_element_ns_ - mean_ns, 0.0) * worst_decay;
  if (element_cost_ns > max_above * mean_ns) worst_element_ns_ = std::max(worst_element_ns_, element_cost_ns);
}

double CostLine::worst_element_ns(double count) const noexcept {
  return std::max(worst_element_ns_, element_ns(count));
}

double CostLine::predict_ns(double count) const noexcept {
  if (samples_ == 0) return 0.0;
  if (Line line; fit(line)) return line.base_ns + line.slope_ns * count;
  // Counts that were seen long ago have next to no weight left: at least one element is assumed per sample.
  const double ratio = std::max(1.0, count * weight_ / std::max(counts_, weight_));
  return costs_ / weight_ * ratio;
}

double CostLine::promised_ns(double count) const noexcept {
  return predict_ns(count) * (1.0 + safety_factor * (above_ - 1.0));
}

double CostLine::element_ns(double count) const noexcept {
  const double mean_ns = count > 0.0 ? predict_ns(count) / count : 0.0;
  Line line;
  return fit(line) ? std::max(line.slope_ns, mean_ns / 4.0) : mean_ns;
}

}  // namespace rtstdb::scheduler
