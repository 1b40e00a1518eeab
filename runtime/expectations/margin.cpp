#include "runtime/expectations/margin.hpp"

#include <limits>
#include <span>
#include <utility>
#include <vector>

namespace hil::expectations {
namespace {

using Node = config::Expression::Node;

/// Turns the condition at `index` into its margin. The nodes keep their numbers, by which functions get their
/// random numbers. False: there is none.
bool turn_into_margin(std::vector<Node>& nodes, std::uint32_t index) {
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
      node.is_margin = true;
      return true;
    case Operation::any_of:
    case Operation::all_of:
      node.word.text = node.operation == Operation::any_of ? "max" : "min";
      node.operation = Operation::call;
      return turn_into_margin(nodes, node.parts[0]) && turn_into_margin(nodes, node.parts[1]);
    case Operation::negation:
      node.operation = Operation::minus;
      return turn_into_margin(nodes, node.parts[0]);
    default:
      return false;
  }
}

}  // namespace

ConditionMargin::ConditionMargin(const config::Expression& condition, const signals::SignalTable& table,
                                 const expression::CompileOptions& options) {
  std::vector<Node> nodes(condition.nodes().begin(), condition.nodes().end());
  if (!turn_into_margin(nodes, static_cast<std::uint32_t>(nodes.size() - 1))) return;
  config::Diagnostics of_units;  // a mistake: the comparisons have different dimensions
  expression_ = signals::SignalExpression::compile(condition.with_nodes(std::move(nodes)), table,
                                                   {.unit = std::nullopt}, options, of_units);
}

double ConditionMargin::at(const signals::SignalTable& table, signals::Instant instant) noexcept {
  return expression_ ? expression_->evaluate(table, instant, signals::Unpublished::unknown)
                     : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace hil::expectations
