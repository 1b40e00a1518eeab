#include "runtime/expression/simplify.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "runtime/expression/call_type.hpp"
#include "runtime/expression/function.hpp"
#include "runtime/expression/relation.hpp"

namespace hil::expression {
namespace {

using config::Expression;
using Node = Expression::Node;
using Operation = Expression::Operation;
using Term = std::uint32_t;  ///< equal terms are equal expressions

/// The terms of expressions, each once.
class Terms {
 public:
  explicit Terms(const NameSource& source) : source_(source) {}

  Term add(const Expression& expression) {
    const std::span<const Node> nodes = expression.nodes();
    const std::vector<bool> are_arguments = relation_arguments(nodes);
    std::vector<Term> terms;
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      Node node = nodes[i];
      for (std::uint32_t& part : node.parts)
        part = terms[part];
      if (node.operation == Operation::name && !are_arguments[i]) node.word.text = source_(node.word.text);
      terms.push_back(are_arguments[i] || is_relation(node) ? intern(std::move(node))
                                                            : simplify(std::move(node)));
    }
    return terms.back();
  }

  /// The nodes of a term, parts before the whole.
  std::vector<Node> nodes_of(Term term) const {
    std::vector<Node> nodes;
    write(term, nodes);
    return nodes;
  }

 private:
  using Key = std::tuple<Operation, std::string, double, std::string, std::vector<Term>, std::size_t>;

  Term intern(Node node) {
    const Function* function = node.operation == Operation::call ? function_named(node.word.text) : nullptr;
    const bool is_random = function != nullptr && function->per_tick;
    Key key{node.operation, node.word.text,
            node.number,    node.unit ? node.unit->symbol : "",
            node.parts,     is_random ? terms_.size() + 1 : 0};
    const auto [place, is_new] = ids_.try_emplace(std::move(key), static_cast<Term>(terms_.size()));
    if (is_new) terms_.push_back(std::move(node));
    return place->second;
  }
  Term intern(Operation operation, std::vector<Term> parts) {
    Node node{.operation = operation};
    node.parts = std::move(parts);
    return intern(std::move(node));
  }
  Term number(double value) { return intern({.operation = Operation::number, .number = value}); }
  Term truth(bool value) { return intern({.operation = Operation::truth, .number = value ? 1.0 : 0.0}); }

  void write(Term term, std::vector<Node>& nodes) const {
    Node node = terms_[term];
    for (std::uint32_t& part : node.parts) {
      write(part, nodes);
      part = static_cast<std::uint32_t>(nodes.size() - 1);
    }
    nodes.push_back(std::move(node));
  }

  Operation operation(Term term) const { return terms_[term].operation; }
  std::optional<bool> truth_of(Term term) const {
    if (operation(term) != Operation::truth) return std::nullopt;
    return terms_[term].number != 0.0;
  }
  bool is_plain(Term term, double value) const {
    return operation(term) == Operation::number && !terms_[term].unit && terms_[term].number == value;
  }
  /// Whether it is computed from numbers and truths alone.
  bool is_constant(Term term) const {
    if (operation(term) == Operation::name || operation(term) == Operation::quoted ||
        operation(term) == Operation::call)
      return false;
    return std::ranges::all_of(terms_[term].parts, [&](Term part) { return is_constant(part); });
  }

  Term simplify(Node node) {
    switch (node.operation) {
      case Operation::greater:
      case Operation::greater_or_equal:
        node.operation = node.operation == Operation::greater ? Operation::less : Operation::less_or_equal;
        std::swap(node.parts[0], node.parts[1]);
        [[fallthrough]];
      case Operation::less:
      case Operation::less_or_equal:
      case Operation::equal:
      case Operation::not_equal:
        if (node.parts[0] != node.parts[1]) break;
        return truth(node.operation == Operation::equal || node.operation == Operation::less_or_equal);
      case Operation::add:
        if (is_plain(node.parts[0], 0.0)) return node.parts[1];
        if (is_plain(node.parts[1], 0.0)) return node.parts[0];
        break;
      case Operation::subtract:
        if (node.parts[0] == node.parts[1]) return number(0.0);
        if (is_plain(node.parts[1], 0.0)) return node.parts[0];
        break;
      case Operation::multiply:
        if (is_plain(node.parts[0], 1.0)) return node.parts[1];
        if (is_plain(node.parts[1], 1.0)) return node.parts[0];
        break;
      case Operation::divide:
        if (node.parts[0] == node.parts[1] && !is_constant(node.parts[0])) return number(1.0);
        if (is_plain(node.parts[1], 1.0)) return node.parts[0];
        break;
      case Operation::minus:
        if (operation(node.parts[0]) == Operation::minus) return terms_[node.parts[0]].parts[0];
        break;
      case Operation::negation:
        return negated(node.parts[0]);
      case Operation::any_of:
      case Operation::all_of:
        return joined(node.operation, node.parts);
      case Operation::conditional:
        if (const auto chosen = truth_of(node.parts[0])) return node.parts[*chosen ? 1 : 2];
        if (node.parts[1] == node.parts[2]) return node.parts[1];
        break;
      case Operation::call:
        return simplified_call(std::move(node));
      default:
        break;
    }
    return intern(std::move(node));
  }

  Term negated(Term term) {
    const auto& parts = terms_[term].parts;
    switch (operation(term)) {
      case Operation::truth:
        return truth(terms_[term].number == 0.0);
      case Operation::negation:
        return parts[0];
      case Operation::less:
        return intern(Operation::less_or_equal, {parts[1], parts[0]});
      case Operation::less_or_equal:
        return intern(Operation::less, {parts[1], parts[0]});
      case Operation::equal:
        return intern(Operation::not_equal, parts);
      case Operation::not_equal:
        return intern(Operation::equal, parts);
      default:
        return intern(Operation::negation, {term});
    }
  }

  /// Of `and` and `or`.
  Term joined(Operation joining, const std::vector<Term>& parts) {
    const bool deciding = joining == Operation::any_of;  // one such part decides
    std::vector<Term> all;
    const auto add_part = [&](Term part) {
      if (std::ranges::find(all, part) == all.end() && truth_of(part) != !deciding) all.push_back(part);
    };
    for (const Term part : parts) {
      if (operation(part) != joining) {
        add_part(part);
        continue;
      }
      for (const Term inner : std::vector(terms_[part].parts))
        add_part(inner);
    }
    for (const Term part : all) {
      const bool has_opposite = std::ranges::find(all, negated(part)) != all.end();
      if (truth_of(part) || has_opposite) return truth(deciding);
    }
    if (all.empty()) return truth(!deciding);
    return all.size() == 1 ? all.front() : intern(joining, std::move(all));
  }

  Term simplified_call(Node node) {
    const Function* const function = function_named(node.word.text);
    if (function == nullptr || node.parts.empty()) return intern(std::move(node));
    const auto is_one_of = [&](std::initializer_list<std::string_view> names) {
      return std::ranges::find(names, node.word.text) != names.end();
    };
    const std::vector<Term>& parts = node.parts;
    const bool is_of_constant = is_constant(parts[0]);
    const bool is_reset = parts.size() > 1 && truth_of(parts[1]) == true;
    if (is_one_of({"min", "max"})) {
      std::vector<Term> different;
      for (const Term part : parts)
        if (std::ranges::find(different, part) == different.end()) different.push_back(part);
      if (different.size() == 1) return different.front();
      node.parts = std::move(different);
    } else if (is_one_of({"clamp"}) && parts.size() == 3 && parts[1] == parts[2]) {
      return parts[1];
    } else if (is_one_of({"latch"}) && (is_reset || truth_of(parts[0]) == false)) {
      return truth(false);
    } else if (is_one_of({"count", "duration"}) && (is_reset || truth_of(parts[0]) == false)) {
      return number(0.0);
    } else if (is_one_of({"integral"}) && is_reset) {
      return number(0.0);
    } else if (is_one_of({"rise", "fall", "changed"}) && is_of_constant) {
      return truth(false);
    } else if (is_one_of({"known"}) && is_of_constant) {
      return truth(true);
    } else if (is_of_constant && has_constant_result(node)) {
      return parts[0];
    }
    return intern(std::move(node));
  }
  /// Whether the function goes from one value of its first argument to another one, without an initial one.
  static bool has_constant_result(const Node& call) {
    constexpr std::array<std::pair<std::string_view, std::size_t>, 5> followers{
        {{"previous", 1}, {"delay", 2}, {"lag", 2}, {"hold", 2}, {"rate_limit", 3}}};
    return std::ranges::any_of(followers, [&](const auto& follower) {
      return follower.first == call.word.text && call.parts.size() <= follower.second;
    });
  }

  const NameSource& source_;
  std::vector<Node> terms_;
  std::map<Key, Term> ids_;
};

}  // namespace

Expression simplified(const Expression& expression, const NameSource& source) {
  Terms terms(source);
  return expression.with_nodes(terms.nodes_of(terms.add(expression)));
}

bool are_equal(const Expression& first, const Expression& second, const NameSource& source) {
  Terms terms(source);
  return terms.add(first) == terms.add(second);
}

}  // namespace hil::expression
