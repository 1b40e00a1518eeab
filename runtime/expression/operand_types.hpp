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

#include "runtime/config/diagnostics.hpp"
#include "runtime/config/expression.hpp"
#include "runtime/units/unit.hpp"

namespace hil::expression {

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
  bool is_difference = false;        ///< of two values in a unit with an offset
  std::optional<double> constant{};  ///< its value, if it is known

  bool is_number() const { return kind == Kind::bare || kind == Kind::quantity || kind == Kind::opaque; }
  bool is_plain() const { return kind == Kind::bare || (kind == Kind::quantity && dimension.is_one()); }
};

Type quantity(const units::Unit& unit);
Type quantity(const units::Dimension& dimension);
Type truth();

units::Unit si_unit(const units::Dimension& dimension);
/// Whether its values are those in the SI.
bool is_si(const units::Unit& unit);
/// For mistakes: "km/h", "a plain number".
std::string unit_text(const Type& type);

/// How a bare number beside a unit with an offset is meant.
enum class Offset : std::uint8_t {
  of_values,   ///< both are values: 80 beside degC is 80 degC
  of_changes,  ///< the number may be a change: refused
};

/// The types of all nodes of an expression, and the rules for operands that belong together. A broken rule
/// adds a mistake at its node.
class OperandTypes {
 public:
  /// The nodes and the diagnostics outlive it.
  OperandTypes(std::span<const config::Expression::Node> nodes, config::Diagnostics& diagnostics)
      : nodes_(nodes), diagnostics_(diagnostics), types_(nodes.size()), conversions_(nodes.size()) {}

  const config::Expression::Node& node(std::size_t index) const { return nodes_[index]; }
  Type& operator[](std::size_t index) { return types_[index]; }
  const Type& operator[](std::size_t index) const { return types_[index]; }
  /// Of the node's result to the SI.
  units::Conversion& conversion(std::size_t index) { return conversions_[index]; }
  /// Whether the node is a number that counts as true where it is not 0.
  bool is_tested(std::uint32_t index) const { return is_tested_.contains(index); }

  /// Adds a mistake, and returns the type of an operand with one.
  Type fail(std::size_t node, const std::string& message);
  /// The sign of the node, or the name of its function.
  std::string name_of(std::size_t node) const;

  /// The type of two numbers that have to be alike; a bare one takes the unit of the other. `at`: the node
  /// that joins them.
  std::optional<Type> joined(std::size_t at, std::uint32_t first, std::uint32_t second, Offset offset);
  void take_unit(std::uint32_t bare, const units::Unit& unit);
  /// False with a mistake: `part` is a truth.
  bool need_number(std::size_t at, std::uint32_t part);
  /// False with a mistake: `part` is neither a truth nor a plain number. `reader` needs it: "'and'".
  bool need_truth(std::uint32_t part, const std::string& reader);

 private:
  std::optional<Type> adopted(std::size_t at, std::uint32_t bare, std::uint32_t other, Offset offset);

  const std::span<const config::Expression::Node> nodes_;
  config::Diagnostics& diagnostics_;
  std::vector<Type> types_;
  std::vector<units::Conversion> conversions_;
  std::set<std::uint32_t> is_tested_;
};

}  // namespace hil::expression
