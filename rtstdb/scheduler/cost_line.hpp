#pragma once
// Cost as a function of a count: a line fitted by weighted least squares to samples whose weight decays. The
// line never falls and never goes below zero. Beside it the class keeps how far the last samples lay above
// the line, and what the most expensive elements cost.
//
// Threads: one at a time. No function allocates.

#include <cstdint>

namespace rtstdb::scheduler {

class CostLine {
 public:
  /// A sample that lies further above the line than this many times is attributed to the operating system.
  static constexpr double max_above = 4.0;

  /// A sample: `count` elements took `cost_ns` together.
  void update(double count, double cost_ns) noexcept;
  /// A part of a run over `count` elements cost `element_ns` per element. It is remembered, and decays, where
  /// it is far above the line.
  void update_from_worst_element(double count, double element_ns) noexcept;

  /// The expected cost; zero before the first sample. Where all samples have the same count, a larger count
  /// costs in proportion and a smaller one the same.
  double predict_ns(double count) const noexcept;
  /// The expected cost plus 1.25 times the largest excess of the last samples.
  double promised_ns(double count) const noexcept;
  /// The cost of one more element beside `count` of them, at least a quarter of their mean; zero before the
  /// first sample.
  double element_ns(double count) const noexcept;
  /// The cost of the most expensive element, element_ns where none is known to be far above it.
  double worst_element_ns(double count) const noexcept;

  std::uint64_t samples() const noexcept { return samples_; }
  /// The largest ratio of a sample to its prediction, decaying; 1 to max_above.
  double above() const noexcept { return above_; }

 private:
  struct Line {
    double base_ns = 0.0, slope_ns = 0.0;
  };
  /// False while all samples have about the same count.
  bool fit(Line& line) const noexcept;
  bool costs_have_changed(double ratio) noexcept;

  double weight_ = 0.0, counts_ = 0.0, costs_ = 0.0, counts_squared_ = 0.0, counts_costs_ = 0.0;
  double above_ = 1.0;
  double worst_element_ns_ = 0.0;
  std::uint64_t samples_ = 0;
  int outliers_in_a_row_ = 0;  ///< far above the prediction; negative: far below
};

}  // namespace rtstdb::scheduler
