#pragma once
// The types of the operands of an expression while it is compiled: truths, and numbers with their units.
//
// Threads: the one that compiles.

#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>
#include <hil/unit.hpp>

#include "runtime/config/expression.hpp"

namespace hil::expression {

/// What a value in K is. A point is a temperature on its scale, as 20 degC, a difference one of two points.
enum class Temperature : std::uint8_t {
  none,
  point,
  difference,
  kelvin,   ///< in K: a point where one is needed, else a difference
  open,     ///< a product or a sum in K: a point where one is needed, else a difference; refused beside a
            ///< number in degC or degF
  degrees,  ///< a number in degC or degF: a difference beside a difference, else a point
};

/// What an operand is.
struct Type {
  enum class Kind : std::uint8_t {
    truth,
    bare,      ///< a number without a unit, which takes that of the operand beside it
    quantity,  ///< in the SI
    opaque,    ///< in a unit that is none, which is not converted
    invalid,   ///< it has a mistake
  };
  Kind kind = Kind::invalid;
  units::Dimension dimension{};
  /// The unit of its names and numbers, if that is one; a bare number beside it takes it.
  std::optional<units::Unit> unit{};
  std::string opaque_unit{};
  Temperature temperature = Temperature::none;
  units::Angle angle{};
  bool lacks_unit = false;           ///< a signal of a device to which nothing gives a unit
  std::optional<double> constant{};  ///< its value, if it is known

  bool is_number() const { return kind == Kind::bare || kind == Kind::quantity || kind == Kind::opaque; }
  bool is_plain() const { return kind == Kind::bare || (kind == Kind::quantity && dimension.is_one()); }
  /// A temperature on its scale, unless it becomes a difference.
  bool is_point() const { return temperature == Temperature::point || temperature == Temperature::degrees; }
};

Type quantity(const units::Unit& unit);
/// Computed from several units.
Type quantity(const units::Dimension& dimension);
Type truth();

units::Unit si_unit(const units::Dimension& dimension);
/// The unit of the SI with the angle that counts in it: "rad/s".
units::Unit natural_unit(const Type& type);
/// For mistakes: "km/h", "a plain number".
std::string unit_text(const Type& type);
/// "in km/h", "a plain number"
std::string in_unit_text(const Type& type);
std::string in_unit_text(const std::string& unit);
/// "a value in km/h", "a plain number"
std::string described(const Type& type);

/// What a number without a unit may be beside a unit with an offset (degC).
enum class BareNumber : std::uint8_t {
  is_value,           ///< a value on the scale: 80 beside degC is 80 degC
  may_be_difference,  ///< a value or a difference: refused
};

/// The types of all nodes of an expression, and the rules for operands that belong together. A broken rule
/// adds a mistake at its node.
class OperandTypes {
 public:
  /// The nodes and the diagnostics outlive it.
  OperandTypes(std::span<const config::Expression::Node> nodes, config::Diagnostics& diagnostics)
      : nodes_(nodes),
        diagnostics_(diagnostics),
        types_(nodes.size()),
        conversions_(nodes.size()),
        named_constants_(nodes.size()) {}

  const config::Expression::Node& node(std::size_t index) const { return nodes_[index]; }
  Type& operator[](std::size_t index) { return types_[index]; }
  const Type& operator[](std::size_t index) const { return types_[index]; }
  /// Converts the node's result to the SI.
  units::Conversion& conversion(std::size_t index) { return conversions_[index]; }
  /// Whether the node is a number that counts as true where it is not 0.
  bool is_tested(std::uint32_t index) const { return is_tested_.contains(index); }

  /// Adds a mistake, and returns the type of an operand with one.
  Type fail(std::size_t node, const std::string& message);
  void warn(std::size_t node, const std::string& message);
  /// The value in the SI of a name that has it in each step, where the scenario makes it so.
  std::optional<double>& named_constant(std::size_t node) { return named_constants_[node]; }
  /// The steps of all delays of the scenario, with those of the delay at the node.
  std::uint64_t add_delay(std::size_t node, std::uint64_t steps) {
    return diagnostics_.add_delay(nodes_[node].word.place, steps);
  }
  /// The sign of the node, or the name of its function.
  std::string name_of(std::size_t node) const;

  /// The type of two numbers that have to be alike; a bare one takes the unit of the other. `at`: the node
  /// that joins them. Of a call, the first one keeps its angle.
  std::optional<Type> common_type(std::size_t at, std::uint32_t first, std::uint32_t second,
                                  BareNumber bare_number);
  /// The type of a sum or a difference of two numbers.
  std::optional<Type> type_of_sum(std::size_t at, std::uint32_t first, std::uint32_t second, bool is_sum);
  void take_unit(std::uint32_t bare, const units::Unit& unit);
  /// False with a mistake: `part` is a temperature, not a difference. A number in degrees becomes a
  /// difference. `reader` needs it: "'noise'".
  bool take_difference(std::uint32_t part, const std::string& reader);
  /// False: the value does not convert to this angle (units::two_pi_exponent_between).
  bool take_angle(std::uint32_t part, const units::Angle& angle);
  /// Warns where a signal that lacks a unit is beside a value in one that is not of the SI.
  void warn_of_missing_unit(std::uint32_t part, const Type& other);
  /// False with a mistake: `part` is a truth.
  bool need_number(std::size_t at, std::uint32_t part);
  /// False with a mistake: `part` is neither a truth nor a plain number. `reader` needs it: "'and'".
  bool need_truth(std::uint32_t part, const std::string& reader);

 private:
  std::optional<Type> type_of_number_beside(std::size_t at, std::uint32_t bare, std::uint32_t other,
                                            BareNumber bare_number);
  std::optional<Temperature> common_temperature(std::size_t at, std::uint32_t first, std::uint32_t second);
  std::optional<Temperature> temperature_of_sum(std::size_t at, std::uint32_t first, std::uint32_t second);
  std::optional<Temperature> temperature_of_difference(std::size_t at, std::uint32_t first,
                                                       std::uint32_t second);
  std::optional<units::Angle> convert_to_common_angle(std::size_t at, std::uint32_t first,
                                                      std::uint32_t second);
  void settle_as_difference(std::uint32_t part);

  const std::span<const config::Expression::Node> nodes_;
  config::Diagnostics& diagnostics_;
  std::vector<Type> types_;
  std::vector<units::Conversion> conversions_;
  std::vector<std::optional<double>> named_constants_;
  std::set<std::uint32_t> is_tested_;
};

}  // namespace hil::expression
