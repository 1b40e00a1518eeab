#include "runtime/expectations/plotted.hpp"

#include <algorithm>
#include <cstdint>

#include "runtime/expectations/signal_constant.hpp"

namespace hil::expectations {
namespace {

bool is_bound(config::Expression::Operation operation) {
  using Operation = config::Expression::Operation;
  return operation == Operation::less || operation == Operation::less_or_equal ||
         operation == Operation::greater || operation == Operation::greater_or_equal;
}

/// Adds the parts of the node at `index`, and it, in the order of their numbers.
void collect(const config::Expression& expression, std::uint32_t index,
             std::vector<config::Expression::Node>& nodes) {
  config::Expression::Node node = expression.nodes()[index];
  for (std::uint32_t& part : node.parts) {
    collect(expression, part, nodes);
    part = static_cast<std::uint32_t>(nodes.size() - 1);
  }
  nodes.push_back(std::move(node));
}

/// Of the part of a condition, in the unit of the signal it is compared with. Empty: it is no constant.
std::optional<double> constant_at(const config::Expression& condition, std::uint32_t index,
                                  const std::string& unit) {
  std::vector<config::Expression::Node> nodes;
  collect(condition, index, nodes);
  config::Diagnostics of_no_constant;
  return check_constant(condition.with_nodes(std::move(nodes)), ConstantKind::value, unit, "",
                        of_no_constant);
}

}  // namespace

void Plotted::add(signals::SignalId signal) {
  if (std::ranges::find(signals, signal) == signals.end()) signals.push_back(signal);
}

void Plotted::add(const config::Expression& condition, const signals::SignalTable& table) {
  const auto signal_at = [&](std::uint32_t index) -> std::optional<signals::SignalId> {
    const config::Expression::Node& node = condition.nodes()[index];
    return node.operation == config::Expression::Operation::name ? table.find(node.word.text) : std::nullopt;
  };
  for (std::uint32_t i = 0; i < condition.nodes().size(); ++i) {
    if (const auto signal = signal_at(i)) add(*signal);
  }
  for (const config::Expression::Node& node : condition.nodes()) {
    if (!is_bound(node.operation)) continue;
    for (const auto& [name, constant] :
         {std::pair(node.parts[0], node.parts[1]), std::pair(node.parts[1], node.parts[0])}) {
      const auto signal = signal_at(name);
      if (!signal) continue;
      if (const auto value = constant_at(condition, constant, table.info(*signal).unit))
        limits.push_back({*signal, *value});
    }
  }
}

}  // namespace hil::expectations
