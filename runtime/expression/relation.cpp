#include "runtime/expression/relation.hpp"

#include <algorithm>
#include <array>

#include <hil/numbers.hpp>
#include <hil/unit.hpp>

namespace hil::expression {
namespace {

using config::in_quotes;
using Node = config::Expression::Node;
using Operation = config::Expression::Operation;

constexpr std::array<RelationFunction, 6> all_functions{{
    {RelationKind::distance, "distance", "m", "body, other",
     "Between the surfaces of two bodies, in m; minus the depth while they overlap."},
    {RelationKind::contact, "contact", "", "body, other", "Whether the two bodies touch."},
    {RelationKind::time_to_impact, "time_to_impact", "s", "body, other, [window]",
     "Until the first contact of the two bodies, if both keep their velocities; the window if there is none "
     "in it. 0 while they touch. The window is a constant duration; default and maximum: 10 s."},
    {RelationKind::inside, "inside", "", "body, region",
     "Whether the body is in the region: a part of its oriented bounds, or, with `whole: true`, all of "
     "them."},
    {RelationKind::crossed_at, "crossed_at", "s", "body, region",
     "The run time at which the body entered or left the region last, also between two ticks; unknown before "
     "it has, and until a commit of the world after the crossing has made it final."},
    {RelationKind::sees, "sees", "", "beam, body",
     "Whether the body is the first that the beam meets; the beam passes through its carrier."},
}};

/// The constant duration that a node is; empty for any other.
std::optional<double> duration_of(const Node& node) {
  if (node.operation != Operation::number || !node.unit) return std::nullopt;
  if (node.unit->dimension != units::Dimension{{0, 0, 1}}) return std::nullopt;
  return node.unit->to_si(node.number);
}

}  // namespace

std::span<const RelationFunction> relation_functions() {
  return all_functions;
}

const RelationFunction* relation_function(std::string_view name) {
  const auto found = std::ranges::find(all_functions, name, &RelationFunction::name);
  return found == all_functions.end() ? nullptr : &*found;
}

bool is_relation(const Node& node) {
  return node.operation == Operation::call && relation_function(node.word.text) != nullptr;
}

std::optional<Relation> relation_of(std::span<const Node> nodes, std::size_t node,
                                    config::Diagnostics* diagnostics) {
  const auto refuse = [&](const config::Place& place, const std::string& why) -> std::optional<Relation> {
    if (diagnostics != nullptr) diagnostics->add(place, why);
    return std::nullopt;
  };
  const Node& call = nodes[node];
  const RelationFunction& function = *relation_function(call.word.text);
  Relation relation{.function = &function};
  const std::string name = in_quotes(call.word.text);
  const std::size_t max_arguments = function.kind == RelationKind::time_to_impact ? 3 : 2;
  if (call.parts.size() < 2 || call.parts.size() > max_arguments) {
    return refuse(call.word.place, name + " has " + std::to_string(call.parts.size()) +
                                       (call.parts.size() == 1 ? " argument" : " arguments") +
                                       ", but takes (" + std::string(function.arguments) + ")");
  }
  for (std::size_t k = 0; k < 2; ++k) {
    const Node& part = nodes[call.parts[k]];
    if (part.operation != Operation::name)
      return refuse(part.word.place, name + " takes names: (" + std::string(function.arguments) + ")");
    (k == 0 ? relation.first : relation.second) = part.word;
  }
  if (relation.first.text == relation.second.text) {
    return refuse(
        nodes[call.parts[1]].word.place,
        in_quotes(relation.second.text) + " is both arguments of " + name + "; name two different ones");
  }
  if (call.parts.size() == 2) return relation;
  const Node& last = nodes[call.parts[2]];
  const std::optional<double> window_s = duration_of(last);
  if (!window_s || !(*window_s > 0.0) || *window_s > max_impact_window_s) {
    return refuse(last.word.place, "the window of " + name +
                                       " is a constant duration above 0 s and of at most " +
                                       config::format_number(max_impact_window_s) + " s, as '2 s'");
  }
  relation.window_s = *window_s;
  return relation;
}

std::optional<std::string> constant_comparison(std::span<const Node> nodes, std::size_t comparison,
                                               std::size_t part, std::optional<double> other) {
  if (!other || !is_relation(nodes[part])) return std::nullopt;
  const auto relation = relation_of(nodes, part);
  if (!relation || relation->function->kind != RelationKind::time_to_impact) return std::nullopt;
  const Operation operation = nodes[comparison].operation;
  const bool is_first = nodes[comparison].parts[0] == part;
  const bool has_two_results_at_the_window =
      is_first ? operation == Operation::less || operation == Operation::greater_or_equal
               : operation == Operation::greater || operation == Operation::less_or_equal;
  const double window_s = relation->window_s;
  if (*other < window_s || (*other == window_s && has_two_results_at_the_window)) return std::nullopt;
  return "impacts are searched " + config::format_number(window_s) +
         " s ahead, so this comparison has one result with and without an impact; compare with a time "
         "below " +
         config::format_number(window_s) + " s" +
         (window_s < max_impact_window_s ? ", or give a longer window" : "");
}

std::vector<bool> relation_arguments(std::span<const Node> nodes) {
  std::vector<bool> are_arguments(nodes.size());
  for (std::size_t i = nodes.size(); i-- > 0;) {  // parts are before the whole
    if (!is_relation(nodes[i]) && !are_arguments[i]) continue;
    for (const std::uint32_t part : nodes[i].parts)
      are_arguments[part] = true;
  }
  return are_arguments;
}

std::optional<std::string> name_read(std::span<const Node> nodes, std::size_t node) {
  if (nodes[node].operation == Operation::name) return nodes[node].word.text;
  if (!is_relation(nodes[node])) return std::nullopt;
  const auto relation = relation_of(nodes, node);
  return relation ? std::optional(relation_name(*relation)) : std::nullopt;
}

std::vector<std::string> names_read(std::span<const Node> nodes) {
  const std::vector<bool> are_arguments = relation_arguments(nodes);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (are_arguments[i]) continue;
    if (auto name = name_read(nodes, i)) names.push_back(std::move(*name));
  }
  return names;
}

}  // namespace hil::expression
