#pragma once
// A histogram as a picture: time on the horizontal axis, counts on a logarithmic vertical axis, so that one
// late tick in a million is visible.

#include <span>
#include <string>
#include <vector>

#include "runtime/report/html/axis.hpp"
#include "runtime/report/html/svg.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::report {

/// Exact samples as bins of equal width on a linear axis, about `bins` of them from 0 on; negative samples
/// count as 0. Empty for no samples.
Histogram histogram_of(std::span<const std::int64_t> samples_ns, std::size_t bins);

/// Quantiles by rank: the smallest sample that is not exceeded by at least that share of the samples.
Quantiles quantiles_of(std::vector<std::int64_t> samples_ns);

/// A vertical line with its name. Each mark has its line of text, so that names do not overlap.
struct HistogramMark {
  std::string label;
  std::int64_t value_ns = 0;
  const char* css_class = "";
};

struct HistogramChart {
  std::string quantity;  ///< "wake-up latency": names the axis
  Scale::Kind axis = Scale::Kind::logarithmic;
  std::vector<HistogramMark> marks;  ///< from the top down
};

/// Values of zero or less are at the left end of a logarithmic axis. For a histogram without counts it
/// draws a sentence.
void draw_histogram(Markup& out, const Histogram& histogram, const HistogramChart& chart);

}  // namespace hil::report
