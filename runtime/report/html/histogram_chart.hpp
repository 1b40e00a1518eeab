#pragma once
// A histogram as a picture: time across, count upwards on a logarithmic axis, so that one late tick in a
// million is seen.

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

/// The quantile by rank: the smallest sample that at least a share of `share` does not exceed. Empty spread
/// for none.
Quantiles spread_of(std::vector<std::int64_t> samples_ns);

/// A vertical line with its name; each mark has a line of text of its own, so that two never overlap.
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

/// Values of zero or less stand at the left end of a logarithmic axis. A histogram without counts draws a
/// sentence.
void draw_histogram(Markup& out, const Histogram& histogram, const HistogramChart& chart);

}  // namespace hil::report
