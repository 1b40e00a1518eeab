#pragma once
// Relations of bodies of the world, which expressions read like functions: distance(ego, runner). Their
// arguments are names of bodies, regions (world.regions) and beams (world.beams), not values. In a run each
// has a signal, whose name is its text in one form: relation_name().
//
// Threads: pure functions.

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "runtime/config/diagnostics.hpp"
#include "runtime/config/expression.hpp"

namespace hil::expression {

enum class RelationKind : unsigned char { distance, contact, time_to_impact, inside, crossed_at, sees };

struct RelationFunction {
  RelationKind kind{};
  std::string_view name;
  std::string_view unit;       ///< of the value; "": true or false
  std::string_view arguments;  ///< for documentation: "body, other"
  std::string_view about;
};

std::span<const RelationFunction> relation_functions();
/// Null: there is none of that name.
const RelationFunction* relation_function(std::string_view name);

inline constexpr double max_impact_window_s = 10.0;

/// A relation that an expression reads.
struct Relation {
  const RelationFunction* function = nullptr;
  config::Word first{}, second{};         ///< the arguments that are names
  double window_s = max_impact_window_s;  ///< of time_to_impact: how far ahead impacts are searched
};

/// "distance(traffic.ego, rock)", "time_to_impact(a, b, 2 s)" with a window other than the longest.
std::string relation_name(const Relation& relation);

/// Whether the node calls a relation function.
bool is_relation(const config::Expression::Node& node);
/// The relation that the node calls. Empty, with a mistake where `diagnostics` is given, when an argument is
/// missing or is no name, or the window is no constant duration in (0, max_impact_window_s]. Misuse: the node
/// calls no relation.
std::optional<Relation> relation_of(std::span<const config::Expression::Node> nodes, std::size_t node,
                                    config::Diagnostics* diagnostics = nullptr);

/// Why a comparison (a node) has one result whatever the bodies do: `part` of it is a time to impact, and the
/// value of the other part lies beyond its window. Empty where that is not so.
std::optional<std::string> constant_comparison(std::span<const config::Expression::Node> nodes,
                                               std::size_t comparison, std::size_t part,
                                               std::optional<double> other);

/// By node: whether it is an argument of a relation, or a part of one, and so names no signal.
std::vector<bool> relation_arguments(std::span<const config::Expression::Node> nodes);
/// The name of the signal that a node reads: a word, or that of a relation. Empty for other nodes.
std::optional<std::string> name_read(std::span<const config::Expression::Node> nodes, std::size_t node);
/// The signals that the nodes read, in their order, repeats included. Arguments of relations are no signals.
std::vector<std::string> names_read(std::span<const config::Expression::Node> nodes);

}  // namespace hil::expression
