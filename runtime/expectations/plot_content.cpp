#include "runtime/expectations/plot_content.hpp"

#include <algorithm>
#include <cstdint>

#include "runtime/expectations/signal_constant.hpp"
#include "runtime/expression/relation.hpp"
#include "runtime/signals/signal_expression.hpp"

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
                                  const signals::SignalInfo& signal) {
  std::vector<config::Expression::Node> nodes;
  collect(condition, index, nodes);
  config::Diagnostics ignored;  // a part that is no constant has no limit
  return check_constant(condition.with_nodes(std::move(nodes)), limit_kind(signal), signal.unit, "", ignored);
}

}  // namespace

void PlotContent::add(signals::SignalId signal) {
  if (std::ranges::find(signals, signal) == signals.end()) signals.push_back(signal);
}

void PlotContent::add(const config::Expression& condition, const signals::SignalTable& table) {
  for (const signals::SignalId signal : signals::signals_in(condition, table))
    add(signal);
  const auto signal_at = [&](std::uint32_t index) -> std::optional<signals::SignalId> {
    const auto name = expression::name_read(condition.nodes(), index);
    return name ? table.find(*name) : std::nullopt;
  };
  for (const config::Expression::Node& node : condition.nodes()) {
    if (!is_bound(node.operation)) continue;
    for (const auto& [name, constant] :
         {std::pair(node.parts[0], node.parts[1]), std::pair(node.parts[1], node.parts[0])}) {
      const auto signal = signal_at(name);
      if (!signal) continue;
      if (const auto value = constant_at(condition, constant, table.info(*signal)))
        limits.push_back({*signal, *value});
    }
  }
}

PlotContent plot_of(signals::SignalId signal) {
  PlotContent content;
  content.add(signal);
  return content;
}

PlotContent plot_of(const config::Expression& condition, const signals::SignalTable& table) {
  PlotContent content;
  content.add(condition, table);
  return content;
}

}  // namespace hil::expectations
