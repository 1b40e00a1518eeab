// Tables from their YAML, with their points there or in a CSV file.

#include <cmath>
#include <string>
#include <utility>

#include <hil/numbers.hpp>

#include "runtime/config/csv_reader.hpp"
#include "runtime/expression/table.hpp"

namespace hil::expression {
namespace {

using config::CsvReader;
using config::Diagnostics;
using config::Field;
using config::in_quotes;
using config::Place;
using config::Schema;
using config::Value;

constexpr std::size_t max_points = 100'000;
constexpr std::size_t max_file_values = 1'000'000;
constexpr double max_number = 1e300;

Schema numbers(std::size_t minimum) {
  return Schema::list(Schema::number(-max_number, max_number), minimum, max_points);
}

Schema axis_schema() {
  return Schema::record_or(
      "unit",
      {
          Field::with_default("unit", Schema::text(), "'1'", "The unit of the points."),
          Field::optional("points", numbers(2),
                          "The points, strictly increasing. Left out with 'file', which contains them."),
      });
}

Schema file_schema() {
  return Schema::record_or(
      "path",
      {
          Field::needed("path", Schema::file(),
                        "A CSV file. For one argument its first row names the columns; for two, it has "
                        "the points of x, and each further row a point of y and the values."),
          Field::optional("x", Schema::text(), "The column with the points of x. Left out: the first one."),
          Field::optional("column", Schema::text(),
                          "The column with the values. Left out: the only other one."),
      });
}

std::optional<units::Unit> read_unit(const Value& text, Diagnostics& diagnostics) {
  auto unit = units::parse_unit(text.text());
  if (!unit) diagnostics.add(text.place(), in_quotes(text.text()) + " is not a known unit");
  return unit;
}

/// False with a mistake: the number is not above the last point. All in the SI but `number`.
bool add_point(Table::Axis& axis, double number, const Place& place, Diagnostics& diagnostics) {
  const double point = axis.unit.to_si(number);
  if (axis.points.empty() || point > axis.points.back()) {
    axis.points.push_back(point);
    return true;
  }
  diagnostics.add(place, "the points of a table have to be strictly increasing, but " +
                             config::format_number(number, 6) + " is not above the point before it");
  return false;
}

/// Fills the axes and the values of one table. Each function returns with mistakes, or is complete.
class TablePoints {
 public:
  TablePoints(const Value& section, Diagnostics& diagnostics)
      : section_(section), diagnostics_(diagnostics), before_(diagnostics.count()) {}

  bool read() {
    const bool is_file = section_.chosen() == "file";
    const bool has_rows = section_.chosen() == "rows";
    if (!is_file && section_.has("y") != has_rows) {
      diagnostics_.add(section_.place(), has_rows ? "a table with 'rows' needs the points of 'y'"
                                                  : "a table with 'y' has 'rows' in place of 'values'");
      return false;
    }
    add_axis("x", is_file);
    if (section_.has("y")) add_axis("y", is_file);
    if (auto unit = read_unit(section_["unit"], diagnostics_)) unit_ = std::move(*unit);
    if (!is_good()) return false;
    if (!is_file)
      read_lists();
    else if (axes_.size() == 1)
      read_columns();
    else
      read_matrix();
    return is_good();
  }

  std::vector<Table::Axis> take_axes() { return std::move(axes_); }
  std::vector<double> take_values() { return std::move(values_); }
  units::Unit take_unit() { return std::move(unit_); }

 private:
  bool is_good() const { return diagnostics_.count() == before_; }

  void add_axis(const std::string& name, bool is_file) {
    const Value& section = section_[name];
    auto unit = read_unit(section["unit"], diagnostics_);
    if (!unit) return;
    axes_.push_back({.unit = std::move(*unit)});
    if (section.has("points") == is_file) {
      diagnostics_.add(section.place(), is_file
                                            ? "the points of " + in_quotes(name) + " are those of the file"
                                            : in_quotes(name) + " needs its 'points'");
      return;
    }
    if (is_file) return;
    for (const Value& point : section["points"].items())
      if (!add_point(axes_.back(), point.number(), point.place(), diagnostics_)) return;
  }

  void read_lists() {
    if (axes_.size() == 1) {
      add_row(section_["values"]);
      return;
    }
    const std::vector<Value>& rows = section_["rows"].items();
    if (rows.size() != axes_[1].points.size()) {
      diagnostics_.add(section_["rows"].place(), std::to_string(rows.size()) + " rows for " +
                                                     std::to_string(axes_[1].points.size()) + " points of y");
    }
    for (const Value& row : rows)
      add_row(row);
  }

  void add_row(const Value& row) {
    if (row.items().size() != axes_[0].points.size()) {
      diagnostics_.add(row.place(), std::to_string(row.items().size()) + " values for " +
                                        std::to_string(axes_[0].points.size()) + " points of x");
    }
    for (const Value& value : row.items())
      values_.push_back(unit_.to_si(value.number()));
  }

  // ---- from a file

  std::optional<double> number_in(const CsvReader& file, std::size_t column) {
    const auto number = file.number(column);
    if (!number || std::abs(*number) <= max_number) return number;
    file.refuse(column, "a number beyond 1e300");
    return std::nullopt;
  }
  bool add_point_of(const CsvReader& file, std::size_t column, Table::Axis& axis) {
    const auto number = number_in(file, column);
    if (!number) return false;
    if (axis.points.size() == max_points) {
      file.refuse(column,
                  "the file has more points than the limit of " + std::to_string(max_points) + "; use fewer");
      return false;
    }
    return add_point(axis, *number, file.place(column), diagnostics_);
  }
  bool add_value_of(const CsvReader& file, std::size_t column) {
    const auto number = number_in(file, column);
    if (!number) return false;
    if (values_.size() == max_file_values) {
      file.refuse(column, "the file has more values than the limit of " + std::to_string(max_file_values) +
                              "; use fewer points");
      return false;
    }
    values_.push_back(unit_.to_si(*number));
    return true;
  }
  void need_two_points(const Table::Axis& axis, const char* one, const char* several) {
    const std::size_t points = axis.points.size();
    if (!is_good() || points >= 2) return;
    diagnostics_.add(file_section()["path"].place(), "the file has " + std::to_string(points) + " " +
                                                         (points == 1 ? one : several) +
                                                         "; a table has at least 2");
  }
  const Value& file_section() const { return section_["file"]; }

  void read_columns() {
    CsvReader file(file_section()["path"].text(), file_section()["path"].place(), diagnostics_);
    if (file.next()) {
      if (file.has_only_numbers())
        return file.refuse(0,
                           "the first row names the columns; this one has only numbers, so a row with names, "
                           "as 'x,value', has to be before it");
      const auto x = column_of_x(file);
      const auto value = x ? column_of_values(file, *x) : std::nullopt;
      if (!value) return;
      while (file.next())
        if (!add_point_of(file, *x, axes_[0]) || !add_value_of(file, *value)) return;
    }
    need_two_points(axes_[0], "row with values", "rows with values");
  }

  std::optional<std::size_t> column_of_x(const CsvReader& file) {
    if (!file_section().has("x")) return 0;
    return file.find_column(file_section()["x"].text(), file_section()["x"].place());
  }
  std::optional<std::size_t> column_of_values(const CsvReader& file, std::size_t x) {
    if (file_section().has("column"))
      return file.find_column(file_section()["column"].text(), file_section()["column"].place());
    if (file.columns() == 2) return 1 - x;
    diagnostics_.add(file_section().place(), "the file has " + std::to_string(file.columns()) +
                                                 " columns; 'column' has to name the one with the values");
    return std::nullopt;
  }

  void read_matrix() {
    for (const char* const key : {"x", "column"}) {
      if (file_section().has(key))
        diagnostics_.add(file_section()[key].place(),
                         in_quotes(key) + " names a column of a table with one argument; this one has 'y'");
    }
    if (!is_good()) return;
    CsvReader file(file_section()["path"].text(), file_section()["path"].place(), diagnostics_);
    if (file.next()) {
      for (std::size_t i = 1; i < file.columns(); ++i)
        if (!add_point_of(file, i, axes_[0])) return;
    }
    need_two_points(axes_[0], "point of x in its first row", "points of x in its first row");
    if (!is_good()) return;
    while (file.next()) {
      if (!add_point_of(file, 0, axes_[1])) return;
      for (std::size_t i = 1; i < file.columns(); ++i)
        if (!add_value_of(file, i)) return;
    }
    need_two_points(axes_[1], "row with values", "rows with values");
  }

  const Value& section_;
  Diagnostics& diagnostics_;
  const std::size_t before_;
  std::vector<Table::Axis> axes_;
  units::Unit unit_;
  std::vector<double> values_;
};

}  // namespace

Schema Table::schema() {
  return Schema::exactly_one(
      {
          Field::optional("values", numbers(1), "One value for each point of x."),
          Field::optional("rows", Schema::list(numbers(1), 2, max_points),
                          "A row for each point of y, with one value for each point of x."),
          Field::optional("file", file_schema(), "The points and the values, in a CSV file."),
      },
      {
          Field::with_default("x", axis_schema(), "{}",
                              "The points of the first argument; with 'file' its unit."),
          Field::optional("y", axis_schema(),
                          "The points of the second argument, with 'rows'; with 'file' its unit."),
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
  TablePoints points(section, diagnostics);
  if (!points.read()) return std::nullopt;
  Table table;
  table.axes_ = points.take_axes();
  table.unit_ = points.take_unit();
  table.values_ = points.take_values();
  table.between_ = section["between"].text() == "linear" ? Between::linear : Between::previous;
  const std::string& outside = section["outside"].text();
  table.outside_ = outside == "hold"     ? Outside::hold
                   : outside == "extend" ? Outside::extend
                                         : Outside::unknown;
  return table;
}

}  // namespace hil::expression
