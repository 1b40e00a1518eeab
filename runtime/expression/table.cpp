#include "runtime/expression/table.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "runtime/config/numbers.hpp"
#include "runtime/config/require.hpp"

namespace hil::expression {
namespace {

using config::Diagnostics;
using config::Field;
using config::Schema;
using config::Value;

constexpr std::int64_t max_points = 100'000;

std::optional<units::Unit> read_unit(const Value& text, Diagnostics& diagnostics) {
  auto unit = units::parse_unit(text.text());
  if (!unit) diagnostics.add(text.place(), config::in_quotes(text.text()) + " is not a known unit");
  return unit;
}

std::optional<Table::Axis> read_axis(const Value& section, Diagnostics& diagnostics) {
  auto unit = read_unit(section["unit"], diagnostics);
  if (!unit) return std::nullopt;
  Table::Axis axis{.unit = std::move(*unit)};
  for (const Value& point : section["points"].items()) {
    const double value = axis.unit.to_si(point.number());
    if (!axis.points.empty() && value <= axis.points.back()) {
      diagnostics.add(point.place(), "the points of a table rise, but " +
                                         config::format_number(point.number(), 6) +
                                         " is not above the point before it");
      return std::nullopt;
    }
    axis.points.push_back(value);
  }
  return axis;
}

Schema numbers() {
  return Schema::list(Schema::number(-1e300, 1e300), 1, static_cast<std::size_t>(max_points));
}

Schema axis_schema() {
  return Schema::record({
      Field::with_default("unit", Schema::text(), "'1'", "The unit of the points."),
      Field::needed("points",
                    Schema::list(Schema::number(-1e300, 1e300), 2, static_cast<std::size_t>(max_points)),
                    "The points, rising."),
  });
}

}  // namespace

Schema Table::schema() {
  return Schema::exactly_one(
      {
          Field::optional("values", numbers(), "One value for each point of x."),
          Field::optional("rows", Schema::list(numbers(), 2, static_cast<std::size_t>(max_points)),
                          "A row for each point of y, with one value for each point of x."),
      },
      {
          Field::needed("x", axis_schema(), "The points of the first argument."),
          Field::optional("y", axis_schema(), "The points of the second argument, with 'rows'."),
          Field::with_default("unit", Schema::text(), "'1'", "The unit of the values."),
          Field::with_default("between", Schema::one_of({"linear", "previous"}), "linear",
                              "The value between two points. linear: on the line between them. previous: "
                              "that of the point below."),
          Field::with_default("outside", Schema::one_of({"hold", "extend", "unknown"}), "hold",
                              "The value beyond the first and the last point. hold: that of this point. "
                              "extend: the line through the last two goes on. unknown: not known."),
      });
}

std::optional<Table> Table::read(const Value& section, Diagnostics& diagnostics) {
  const std::size_t before = diagnostics.count();
  Table table;
  auto x = read_axis(section["x"], diagnostics);
  auto unit = read_unit(section["unit"], diagnostics);
  std::optional<Axis> y;
  const bool has_rows = section.chosen() == "rows";
  if (section.has("y") != has_rows) {
    diagnostics.add(section.place(), has_rows ? "a table with 'rows' needs the points of 'y'"
                                              : "a table with 'y' has 'rows' in place of 'values'");
    return std::nullopt;
  }
  if (has_rows) y = read_axis(section["y"], diagnostics);
  if (diagnostics.count() != before) return std::nullopt;
  const auto add_row = [&](const Value& row) {
    if (row.items().size() != x->points.size()) {
      diagnostics.add(row.place(), std::to_string(row.items().size()) + " values for " +
                                       std::to_string(x->points.size()) + " points of x");
    }
    for (const Value& value : row.items())
      table.values_.push_back(unit->to_si(value.number()));
  };
  if (has_rows) {
    const std::vector<Value>& rows = section["rows"].items();
    if (rows.size() != y->points.size()) {
      diagnostics.add(section["rows"].place(), std::to_string(rows.size()) + " rows for " +
                                                   std::to_string(y->points.size()) + " points of y");
    }
    for (const Value& row : rows)
      add_row(row);
  } else {
    add_row(section["values"]);
  }
  if (diagnostics.count() != before) return std::nullopt;
  table.axes_.push_back(std::move(*x));
  if (y) table.axes_.push_back(std::move(*y));
  table.unit_ = std::move(*unit);
  table.between_ = section["between"].text() == "linear" ? Between::linear : Between::previous;
  const std::string& outside = section["outside"].text();
  table.outside_ = outside == "hold"     ? Outside::hold
                   : outside == "extend" ? Outside::extend
                                         : Outside::unknown;
  return table;
}

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
