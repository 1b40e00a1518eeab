#include "rtstdb/transaction/cost_line.hpp"

#include <algorithm>
#include <optional>

namespace rtstdb::transaction {
namespace {

/// A sample's weight halves every 34 samples after it.
constexpr double fading = 0.98;

/// What lay above halves every 693 samples: who keeps 999 promises of 1,000 remembers what happens once in so many.
constexpr double above_fading = 0.999;

/// So does what the dearest elements cost above the others, every 44: they may be asked seldom.
constexpr double dearest_fading = 1.0 - 1.0 / 64.0;

/// The largest of some samples is not the largest there will be.
constexpr double more_than_seen = 1.25;

struct Line {
  double base_ns = 0.0, slope_ns = 0.0;
};

/// None while all samples have about the same count.
std::optional<Line> fitted(const query::CostSamples& sums) noexcept {
  if (sums.samples == 0) return std::nullopt;
  const double mean_count = sums.counts / sums.weight;
  const double mean_cost = sums.costs / sums.weight;
  const double variance = sums.counts_squared / sums.weight - mean_count * mean_count;
  if (variance <= 1e-6 * std::max(1.0, mean_count * mean_count)) return std::nullopt;
  const double slope = std::max(0.0, (sums.counts_costs / sums.weight - mean_count * mean_cost) / variance);
  const double base = mean_cost - slope * mean_count;
  if (base < 0.0) return Line{0.0, sums.counts_costs / sums.counts_squared};
  return Line{base, slope};
}

/// Whether the sample is the second or a later one in a row that lies as far on the same side.
bool costs_have_changed(query::CostSamples& samples, double ratio) noexcept {
  const int side = ratio > max_above ? 1 : ratio < 1.0 / max_above ? -1 : 0;
  samples.unlike_in_a_row = side * samples.unlike_in_a_row > 0 ? samples.unlike_in_a_row + side : side;
  return samples.unlike_in_a_row * side > 1;
}

}  // namespace

void learn(query::CostSamples& samples, double count, double cost_ns) noexcept {
  const double expected_ns = predict_ns(samples, count);
  double left = fading;
  samples.above = 1.0 + (samples.above - 1.0) * above_fading;
  if (expected_ns > 0.0 && costs_have_changed(samples, cost_ns / expected_ns)) {
    // What was before weighs as much as this one. If that was cheaper, it is no measure of how far costs lie above now.
    left = std::min(fading, 1.0 / samples.weight);
    if (samples.unlike_in_a_row > 0) samples.above = 1.0 + (samples.above - 1.0) / 2.0;
  } else if (expected_ns > 0.0) {
    samples.above = std::max(samples.above, std::min(cost_ns / expected_ns, max_above));
  }
  samples.weight = samples.weight * left + 1.0;
  samples.counts = samples.counts * left + count;
  samples.costs = samples.costs * left + cost_ns;
  samples.counts_squared = samples.counts_squared * left + count * count;
  samples.counts_costs = samples.counts_costs * left + count * cost_ns;
  ++samples.samples;
}

void learn_dearest(query::CostSamples& samples, double count, double element_ns) noexcept {
  const double mean_ns = per_element_ns(samples, count);
  samples.dearest_ns = mean_ns + std::max(samples.dearest_ns - mean_ns, 0.0) * dearest_fading;
  if (element_ns > max_above * mean_ns) samples.dearest_ns = std::max(samples.dearest_ns, element_ns);
}

double dearest_element_ns(const query::CostSamples& samples, double count) noexcept {
  return std::max(samples.dearest_ns, per_element_ns(samples, count));
}

double predict_ns(const query::CostSamples& samples, double count) noexcept {
  if (samples.samples == 0) return 0.0;
  if (const auto line = fitted(samples)) return line->base_ns + line->slope_ns * count;
  // Next to nothing is left of counts that were seen long ago.
  const double more = std::max(1.0, count * samples.weight / std::max(samples.counts, samples.weight));
  return samples.costs / samples.weight * more;
}

double promised_ns(const query::CostSamples& samples, double count) noexcept {
  return predict_ns(samples, count) * (1.0 + more_than_seen * (samples.above - 1.0));
}

double per_element_ns(const query::CostSamples& samples, double count) noexcept {
  const double mean_ns = count > 0.0 ? predict_ns(samples, count) / count : 0.0;
  const auto line = fitted(samples);
  return line ? std::max(line->slope_ns, mean_ns / 4.0) : mean_ns;
}

}  // namespace rtstdb::transaction
