#pragma once
// A tree against a schema. For the files of this folder; parse.hpp is the public side.

#include <optional>
#include <string_view>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

#include "runtime/contract/schema_node.hpp"
#include "runtime/contract/tree.hpp"

namespace hil::config {

/// Adds every mistake in the tree to `diagnostics` and returns the correct parts: records, maps and lists
/// lack the wrong parts, and is_whole is then false. Empty when no part is correct. An unknown key is a
/// mistake but leaves its record whole.
std::optional<Value> check_tree(const TreeNode& tree, const Schema& schema, Diagnostics& diagnostics);

/// The same for a value of Kind::any.
std::optional<Value> check_any(const Value& any_value, const Schema& schema, Diagnostics& diagnostics);

/// The tree of a field's default, read and checked at the first call. Misuse: the field has none, or its
/// schema refuses it. Any thread.
const TreeNode& default_of(const SchemaField& known);

bool is_whole(const Value& value);

/// Whether `word` is made of letters, digits and _ and does not begin with a digit.
bool is_name(std::string_view word);
/// Names joined by dots.
bool is_signal_name(std::string_view word);

}  // namespace hil::config
