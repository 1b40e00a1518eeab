#include "runtime/expectations/margin.hpp"

#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace hil::expectations {
namespace {

using Node = config::Expression::Node;

/// Gives a number beside a signal in a unit with an offset that unit: a difference needs it.
void name_unit(Node& number, const Node& signal, const signals::SignalTable& table) {
  using Operation = config::Expression::Operation;
  if (number.operation != Operation::number || number.unit || signal.operation != Operation::name) return;
  const auto id = table.find(signal.word.text);
  if (!id) return;
  const auto unit = units::parse_unit(table.info(*id).unit);
  if (unit && unit->offset != 0.0) number.unit = unit;
}

/// Turns the condition at `index` into its margin. The nodes keep their numbers, by which functions get their
/// random numbers. False: there is none.
bool turn_into_margin(std::vector<Node>& nodes, std::uint32_t index, const signals::SignalTable& table) {
  using Operation = config::Expression::Operation;
  Node& node = nodes[index];
  switch (node.operation) {
    case Operation::less:
    case Operation::less_or_equal:
      std::swap(node.parts[0], node.parts[1]);
      [[fallthrough]];
    case Operation::greater:
    case Operation::greater_or_equal:
      node.operation = Operation::subtract;
      name_unit(nodes[node.parts[0]], nodes[node.parts[1]], table);
      name_unit(nodes[node.parts[1]], nodes[node.parts[0]], table);
      return true;
    case Operation::any_of:
    case Operation::all_of:
      node.word.text = node.operation == Operation::any_of ? "max" : "min";
      node.operation = Operation::call;
      return turn_into_margin(nodes, node.parts[0], table) && turn_into_margin(nodes, node.parts[1], table);
    case Operation::negation:
      node.operation = Operation::minus;
      return turn_into_margin(nodes, node.parts[0], table);
    default:
      return false;
  }
}

}  // namespace

ConditionMargin::ConditionMargin(const config::Expression& condition, const signals::SignalTable& table,
                                 const expression::CompileOptions& options) {
  std::vector<Node> nodes(condition.nodes().begin(), condition.nodes().end());
  if (!turn_into_margin(nodes, static_cast<std::uint32_t>(nodes.size() - 1), table)) return;
  config::Diagnostics of_units;  // a mistake: the comparisons have different dimensions
  expression_ = signals::SignalExpression::compile(condition.with_nodes(std::move(nodes)), table,
                                                   {.unit = std::nullopt}, options, of_units);
}

double ConditionMargin::at(const signals::SignalTable& table, signals::Instant instant) noexcept {
  return expression_ ? expression_->evaluate(table, instant, signals::Unpublished::unknown)
                     : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace hil::expectations
