#include "runtime/signals/value_names.hpp"

#include <utility>
#include <vector>

namespace hil::signals {
namespace {

using Node = config::Expression::Node;
using Operation = config::Expression::Operation;

/// Adds the nodes whose values the node at `index` may have.
void collect_results(const std::vector<Node>& nodes, std::size_t index, std::vector<std::size_t>& results) {
  if (nodes[index].operation != Operation::conditional) return results.push_back(index);
  for (std::size_t branch = 1; branch < nodes[index].parts.size(); ++branch)
    collect_results(nodes, nodes[index].parts[branch], results);
}

}  // namespace

std::optional<config::Expression> with_named_values(const config::Expression& expression,
                                                    const std::map<std::string, double>& values,
                                                    const std::string& signal, const KnownSignals& known,
                                                    config::Diagnostics& diagnostics) {
  if (values.empty()) return expression;
  std::vector<Node> nodes(expression.nodes().begin(), expression.nodes().end());
  std::vector<std::size_t> results;
  collect_results(nodes, nodes.size() - 1, results);
  bool is_sound = true;
  for (const std::size_t index : results) {
    Node& node = nodes[index];
    const bool is_signal = node.operation == Operation::name &&
                           (node.word.text == "time" || known.table().find(node.word.text) ||
                            known.is_undeclared(node.word.text));
    if (is_signal || (node.operation != Operation::name && node.operation != Operation::quoted)) continue;
    const auto value = value_named(values, node.word, signal, diagnostics);
    is_sound &= value.has_value();
    if (value) node = {.operation = Operation::number, .word = {"", node.word.place}, .number = *value};
  }
  if (!is_sound) return std::nullopt;
  return expression.with_nodes(std::move(nodes));
}

}  // namespace hil::signals
