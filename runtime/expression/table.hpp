#pragma once
// A function of one or two quantities that is given by its values at points: a pump's curve, an engine's map.
// An expression calls it by its name, `pump_curve(level)`.
//
// Threads: immutable once read; at() neither allocates nor blocks.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>
#include <hil/unit.hpp>

namespace hil::expression {

class Table {
 public:
  enum class Between : std::uint8_t { linear, previous };
  enum class Outside : std::uint8_t { hold, extend, unknown };
  struct Axis {
    units::Unit unit;
    std::vector<double> points{};  ///< strictly increasing, in the SI
  };

  /// What a table is in YAML; `read` takes a value of it.
  static config::Schema schema();
  /// Empty with mistakes: points that are not strictly increasing, too few or too many values, units that are
  /// none; of a CSV file with their lines there.
  static std::optional<Table> read(const config::Value& section, config::Diagnostics& diagnostics);

  /// One axis, or two.
  const std::vector<Axis>& axes() const noexcept { return axes_; }
  const units::Unit& unit() const noexcept { return unit_; }

  /// All in the SI. NaN where an argument is, and outside the points if the table is unknown there.
  double at(double x) const noexcept;
  /// Misuse (asserts): a table with one axis.
  double at(double x, double y) const noexcept;

 private:
  /// Between which points an argument lies: at `share` of the way from `index` to the next one.
  struct Position {
    std::size_t index = 0;
    double share = 0.0;
  };
  Position position(const Axis& axis, double argument) const noexcept;
  double along_row(std::size_t row, const Position& x) const noexcept;

  std::vector<Axis> axes_;
  units::Unit unit_;
  std::vector<double> values_;  ///< by row, one row of all x for each y
  Between between_ = Between::linear;
  Outside outside_ = Outside::hold;
};

}  // namespace hil::expression
