#include "runtime/expression/table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include <hil/require.hpp>

namespace hil::expression {

Table::Position Table::position(const Axis& axis, double argument) const noexcept {
  const std::vector<double>& points = axis.points;
  const bool is_outside = !(argument >= points.front() && argument <= points.back());
  if (std::isnan(argument) || (is_outside && outside_ == Outside::unknown))
    return {0, std::numeric_limits<double>::quiet_NaN()};
  if (is_outside && outside_ == Outside::hold) argument = std::clamp(argument, points.front(), points.back());
  // The last interval includes its end.
  const auto above = std::upper_bound(points.begin() + 1, points.end() - 1, argument);
  const auto index = static_cast<std::size_t>(above - points.begin()) - 1;
  const double share = (argument - points[index]) / (points[index + 1] - points[index]);
  if (between_ == Between::linear) return {index, share};
  return share < 1.0 ? Position{index, 0.0} : Position{index + 1, 0.0};
}

double Table::along_row(std::size_t row, const Position& x) const noexcept {
  const double* const values = values_.data() + row * axes_[0].points.size();
  if (x.share == 0.0) return values[x.index];
  if (x.share == 1.0) return values[x.index + 1];
  return values[x.index] + x.share * (values[x.index + 1] - values[x.index]);
}

double Table::at(double x) const noexcept {
  return along_row(0, position(axes_[0], x));
}

double Table::at(double x, double y) const noexcept {
  config::require(axes_.size() == 2, "a table with two axes");
  const Position column = position(axes_[0], x);
  const Position row = position(axes_[1], y);
  const double low = along_row(row.index, column);
  if (row.share == 0.0) return low;
  const double high = along_row(row.index + 1, column);
  return row.share == 1.0 ? high : low + row.share * (high - low);
}

}  // namespace hil::expression
