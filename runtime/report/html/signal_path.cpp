#include "runtime/report/html/signal_path.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace hil::report {
namespace {

bool is_known(const SignalPoint& point) {
  return std::isfinite(point.min) && std::isfinite(point.max);
}

long left_of(const SignalSeries& series, std::uint64_t bucket, const ViewportScale& scale) {
  const double time_ns = static_cast<double>(series.begin_ns - scale.begin_ns) +
                         static_cast<double>(bucket) * static_cast<double>(series.bucket_ns);
  constexpr double farthest = 1e9;
  return std::lround(std::clamp(time_ns / static_cast<double>(scale.column_ns), -farthest, farthest));
}

/// A line of relative steps.
class PathWriter {
 public:
  bool is_open() const { return is_open_; }
  long y() const { return y_; }
  void move(long x, long y) {
    text_ += 'M' + std::to_string(x) + ' ' + std::to_string(y);
    is_open_ = true;
    x_ = x;
    y_ = y;
  }
  void line(long x, long y) {
    text_ += 'l' + std::to_string(x - x_) + ' ' + std::to_string(y - y_);
    x_ = x;
    y_ = y;
  }
  void hold(long x) {
    if (x > x_) text_ += 'h' + std::to_string(x - x_);
    x_ = std::max(x, x_);
  }
  void range(long y) {
    if (y != y_) text_ += 'v' + std::to_string(y - y_);
    y_ = y;
  }
  void close() { is_open_ = false; }
  std::string take() { return std::move(text_); }

 private:
  std::string text_;
  long x_ = 0, y_ = 0;
  bool is_open_ = false;
};

}  // namespace

double x_at(const ViewportScale& scale, std::int64_t time_ns) {
  return static_cast<double>(time_ns - scale.begin_ns) / static_cast<double>(scale.column_ns);
}

long y_at(const ViewportScale& scale, double value) {
  const double share = (scale.range.high - value) / (scale.range.high - scale.range.low);
  return std::lround(std::clamp(share, 0.0, 1.0) * viewport_height);
}

std::string signal_path(const SignalSeries& series, const ViewportScale& scale, bool is_discrete) {
  PathWriter path;
  for (std::size_t i = 0; i < series.points.size(); ++i) {
    const SignalPoint& point = series.points[i];
    const long x = left_of(series, point.bucket, scale);
    if (!is_known(point)) {
      if (path.is_open()) path.hold(x);
      path.close();
      continue;
    }
    // The range ends at the extreme that is nearer to the next point.
    const bool has_next = i + 1 < series.points.size() && is_known(series.points[i + 1]);
    const SignalPoint& next = has_next ? series.points[i + 1] : point;
    const bool ends_high = next.min + next.max >= point.min + point.max;
    const long first = y_at(scale, ends_high ? point.min : point.max);
    if (!path.is_open()) {
      path.move(x, first);
    } else {
      path.hold(is_discrete ? x : left_of(series, point.bucket - 1, scale));
      path.line(x, first);
    }
    path.range(y_at(scale, ends_high ? point.max : point.min));
  }
  if (path.is_open()) path.hold(left_of(series, series.points.back().bucket + 1, scale));
  return path.take();
}

std::string dots_path(const SignalSeries& series, const ViewportScale& scale, double min_columns) {
  std::string dots;
  const SignalPoint* first = nullptr;  // of the part
  const auto end_part = [&](long end) {
    if (first == nullptr) return;
    const long begin = left_of(series, first->bucket, scale);
    if (static_cast<double>(end - begin) < min_columns)
      dots += 'M' + std::to_string(begin) + ' ' + std::to_string(y_at(scale, first->max)) + "h0";
    first = nullptr;
  };
  for (const SignalPoint& point : series.points) {
    if (!is_known(point))
      end_part(left_of(series, point.bucket, scale));
    else if (first == nullptr)
      first = &point;
  }
  if (first != nullptr) end_part(left_of(series, series.points.back().bucket + 1, scale));
  return dots;
}

std::string tolerance_path(const SignalSeries& reference, const ViewportScale& scale) {
  if (!std::isfinite(reference.tolerance)) return {};
  struct Column {
    long x = 0, upper = 0, lower = 0;
  };
  std::string path;
  std::vector<Column> columns;
  const auto close = [&] {
    for (const Column& column : columns)
      path += (&column == columns.data() ? 'M' : 'L') + std::to_string(column.x) + ' ' +
              std::to_string(column.upper);
    std::ranges::reverse(columns);
    for (const Column& column : columns)
      path += 'L' + std::to_string(column.x) + ' ' + std::to_string(column.lower);
    if (!columns.empty()) path += 'Z';
    columns.clear();
  };
  for (const SignalPoint& point : reference.points) {
    const long x = left_of(reference, point.bucket, scale);
    if (!columns.empty()) {  // the value before it lasts up to its bucket
      Column held = columns.back();
      held.x = left_of(reference, point.bucket - 1, scale);
      columns.push_back(held);
    }
    if (!is_known(point)) {
      close();
      continue;
    }
    columns.push_back(
        {x, y_at(scale, point.max + reference.tolerance), y_at(scale, point.min - reference.tolerance)});
  }
  close();
  return path;
}

}  // namespace hil::report
