#pragma once
// Scales and tick marks of charts.

#include <vector>

namespace hil::report {

struct Interval {
  double low = 0.0;
  double high = 1.0;
};

/// Multiples of 1, 2 or 5 times a power of ten inside `range`, at most `max_count` of them (at least 2).
/// Empty for an interval that is empty or not finite.
std::vector<double> linear_ticks(Interval range, int max_count);

/// The distance between two such ticks.
double linear_step(double length, int max_count);

/// The decimals with which multiples of the step differ.
int decimals_of_step(double step);

/// Powers of ten inside `range`; with 2 and 5 between them when the range spans three decades or less.
/// `range.low` > 0.
std::vector<double> logarithmic_ticks(Interval range);

/// `range`, widened to the next 1, 2 or 5 times a power of ten on each side, and to a factor of ten at least.
Interval rounded_decades(Interval range);

/// Converts values to pixels, linear or logarithmic.
class Scale {
 public:
  enum class Kind { linear, logarithmic };
  /// `values.low` < `values.high`; both above 0 for logarithmic.
  Scale(Kind kind, Interval values, Interval pixels);
  /// Values outside the range are at its ends.
  double operator()(double value) const;

 private:
  double position(double value) const;
  Kind kind_;
  Interval values_;
  Interval pixels_;
};

}  // namespace hil::report
