#include "runtime/report/html/histogram_chart.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "runtime/report/quantities.hpp"

namespace hil::report {
namespace {

constexpr double width = 500.0;
constexpr double plot_left = 46.0;
constexpr double plot_right = 478.0;
constexpr double plot_height = 120.0;
constexpr double mark_row = 15.0;
constexpr double column_px = 5.0;  // narrower bins are one bar
constexpr double below_one = 0.6;  // begin of the count axis, so that a count of one is a visible bar

struct Unit {
  double ns;
  const char* symbol;
};

double as_double(std::int64_t value) {
  return static_cast<double>(value);
}

Interval range_of(const Histogram& histogram, const HistogramChart& chart) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  double smallest_positive = low;
  for (const Bin& bin : histogram) {
    if (bin.count == 0) continue;
    low = std::min(low, as_double(bin.first_ns));
    high = std::max(high, as_double(bin.last_ns) + 1.0);
    smallest_positive = std::min(smallest_positive,
                                 bin.first_ns > 0 ? as_double(bin.first_ns) : as_double(bin.last_ns) + 1.0);
  }
  for (const HistogramMark& mark : chart.marks)
    high = std::max(high, as_double(mark.value_ns));
  if (chart.axis == Scale::Kind::logarithmic) {
    const double start = std::max(smallest_positive, 1.0);
    return rounded_decades({start, std::max(high, start)});
  }
  low = std::min(low, 0.0);
  return {low, high + 0.04 * (high - low)};
}

/// Bars from left to right. A bin narrower than a column is added to the column it begins in.
struct Bar {
  double left = 0.0;
  double right = 0.0;
  std::uint64_t count = 0;
};

std::vector<Bar> bars_of(const Histogram& histogram, const Scale& x) {
  std::vector<Bar> bars;
  for (const Bin& bin : histogram) {
    if (bin.count == 0) continue;
    Bar bar{x(as_double(bin.first_ns)), x(as_double(bin.last_ns) + 1.0), bin.count};
    if (bar.right - bar.left < column_px) {
      bar.left = plot_left + std::floor((bar.left - plot_left) / column_px) * column_px;
      bar.left = std::min(bar.left, plot_right - column_px);
      bar.right = bar.left + column_px;
    }
    if (!bars.empty() && bars.back().left >= bar.left) {
      bars.back().count += bar.count;
      continue;
    }
    if (!bars.empty()) bars.back().right = std::min(bars.back().right, bar.left);
    bars.push_back(bar);
  }
  return bars;
}

class Drawing {
 public:
  Drawing(Markup& out, const Histogram& histogram, const HistogramChart& chart)
      : out_(out),
        chart_(chart),
        range_(range_of(histogram, chart)),
        top_(6.0 + mark_row * static_cast<double>(chart.marks.size())),
        bottom_(top_ + plot_height),
        x_(chart.axis, range_, {plot_left, plot_right}),
        bars_(bars_of(histogram, x_)) {}

  void draw() {
    std::uint64_t highest = 1;
    std::uint64_t total = 0;
    for (const Bar& bar : bars_)
      highest = std::max(highest, bar.count);
    for (const Bar& bar : bars_)
      total += bar.count;
    const double count_top = std::pow(10.0, std::ceil(std::log10(static_cast<double>(highest)) + 0.05));
    const Scale y(Scale::Kind::logarithmic, {below_one, count_top}, {bottom_, top_});
    open_svg(out_, width, bottom_ + 38.0,
             "Histogram of " + chart_.quantity + ", " + counted(total, "sample", "samples"),
             PictureUse::inline_in_page);
    count_axis(y, count_top);
    time_axis();
    for (const Bar& bar : bars_) {
      const double at = y(static_cast<double>(bar.count));
      const double right = std::max(bar.right - 0.6, bar.left + 0.6);
      out_.leaf("rect", {{"class", "bar"},
                         {"x", bar.left},
                         {"y", at},
                         {"width", right - bar.left},
                         {"height", bottom_ - at}});
    }
    svg_line(out_, "axis", {plot_left, bottom_}, {plot_right, bottom_});
    marks();
    out_.close();
  }

 private:
  void count_axis(const Scale& y, double count_top) {
    const int decades = static_cast<int>(std::lround(std::log10(count_top)));
    const int every = decades / 5 + 1;
    for (int decade = 0; decade <= decades; decade += every) {
      const double count = std::pow(10.0, decade);
      svg_line(out_, "grid", {plot_left, y(count)}, {plot_right, y(count)});
      svg_text(out_, "", {plot_left - 6.0, y(count) + 4.0}, "end",
               decade < 4 ? pixels(count) : "10" + superscript(decade));
    }
  }

  static std::string superscript(int digits) {
    static const char* const forms[] = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
    std::string text;
    for (const char digit : std::to_string(digits))
      text += forms[digit - '0'];
    return text;
  }

  void time_axis() {
    const bool logarithmic = chart_.axis == Scale::Kind::logarithmic;
    const Unit unit = logarithmic || range_.high < 2e6 ? Unit{1e3, "µs"}
                      : range_.high < 2e10             ? Unit{1e6, "ms"}
                                                       : Unit{1e9, "s"};
    const std::vector<double> ticks = logarithmic ? logarithmic_ticks(range_) : linear_ticks(range_, 8);
    double free_from = 0.0;
    for (const double tick : ticks) {
      const double at = x_(tick);
      svg_line(out_, "axis", {at, bottom_}, {at, bottom_ + 4.0});
      const std::string text = tick_text(tick / unit.ns);
      const double half = text_width(text, 11.0) / 2.0;
      if (at - half < free_from || at + half > width)
        continue;  // the tick has no number, since it would overlap the last one
      svg_text(out_, "", {at, bottom_ + 16.0}, "middle", text);
      free_from = at + half + 4.0;
    }
    svg_text(out_, "", {(plot_left + plot_right) / 2.0, bottom_ + 32.0}, "middle",
             chart_.quantity + ", " + unit.symbol + (logarithmic ? " (logarithmic)" : ""));
    svg_text(out_, "", {plot_left - 6.0, bottom_ + 32.0}, "middle", "count \u2191");
  }

  static std::string tick_text(double value) {
    if (value >= 1000.0) return count_text(static_cast<std::uint64_t>(std::llround(value)));
    return shortest(std::round(value * 1e6) / 1e6);
  }

  /// Whether the line of a mark above crosses a label between these positions.
  bool is_crossed(std::size_t row, double from, double to) const {
    const auto crosses = [&](const HistogramMark& mark) {
      const double at = x_(as_double(mark.value_ns));
      return at > from && at < to;
    };
    return std::any_of(chart_.marks.begin(), chart_.marks.begin() + static_cast<std::ptrdiff_t>(row),
                       crosses);
  }

  void marks() {
    for (std::size_t row = 0; row < chart_.marks.size(); ++row) {
      const HistogramMark& mark = chart_.marks[row];
      const double baseline = 12.0 + mark_row * static_cast<double>(row);
      const double at = x_(as_double(mark.value_ns));
      const std::string text = mark.label + ' ' + measured_time(mark.value_ns);
      const double space = 5.0 + text_width(text, 11.0);
      const bool right_is_good = at + space < width && !is_crossed(row, at, at + space);
      const bool rightwards = right_is_good || at - space < 0.0;
      svg_line(out_, (std::string("mark ") + mark.css_class).c_str(), {at, baseline - 9.0}, {at, bottom_});
      svg_text(out_, (std::string("strong label ") + mark.css_class + "-text").c_str(),
               {rightwards ? at + 5.0 : at - 5.0, baseline}, rightwards ? "start" : "end", text);
    }
  }

  Markup& out_;
  const HistogramChart& chart_;
  Interval range_;
  double top_;
  double bottom_;
  Scale x_;
  std::vector<Bar> bars_;
};

}  // namespace

Histogram histogram_of(std::span<const std::int64_t> samples_ns, std::size_t bins) {
  std::int64_t high = 0;
  for (const std::int64_t sample : samples_ns)
    high = std::max(high, sample);
  const std::int64_t step =
      std::max<std::int64_t>(high / static_cast<std::int64_t>(std::max<std::size_t>(bins, 1)), 1);
  std::map<std::int64_t, std::uint64_t> counts;
  for (const std::int64_t sample : samples_ns)
    ++counts[std::max<std::int64_t>(sample, 0) / step];
  Histogram histogram;
  for (const auto& [index, count] : counts) {
    const std::int64_t first = index * step;
    const std::int64_t space = std::numeric_limits<std::int64_t>::max() - first;
    histogram.push_back({first, first + std::min(step - 1, space), count});
  }
  return histogram;
}

Quantiles quantiles_of(std::vector<std::int64_t> samples_ns) {
  if (samples_ns.empty()) return {};
  std::ranges::sort(samples_ns);
  const auto at_share = [&](double share) {
    const auto rank = static_cast<std::size_t>(std::ceil(share * static_cast<double>(samples_ns.size())));
    return samples_ns[std::clamp<std::size_t>(rank, 1, samples_ns.size()) - 1];
  };
  return {samples_ns.size(), at_share(0.5), at_share(0.99), at_share(0.999), samples_ns.back()};
}

void draw_histogram(Markup& out, const Histogram& histogram, const HistogramChart& chart) {
  const bool empty = std::ranges::all_of(histogram, [](const Bin& bin) { return bin.count == 0; });
  if (empty) {
    out.element("p", {{"class", "soft small"}}, "No samples.");
    return;
  }
  Drawing(out, histogram, chart).draw();
}

}  // namespace hil::report
