#pragma once
// A tree against a schema. For the files of this folder; parse.hpp is the public side.

#include <optional>
#include <string_view>

#include "runtime/config/diagnostics.hpp"
#include "runtime/config/schema.hpp"
#include "runtime/config/tree.hpp"

namespace hil::config {

/// Finds every mistake in the tree, and gives what is right even so: in records, maps and lists the parts
/// that were wrong are left out and is_whole is false. Empty when nothing is left. An unknown key is a
/// mistake but leaves its record whole.
std::optional<Value> check_tree(const TreeNode& tree, const Schema& schema, Diagnostics& diagnostics);

/// The same for a value of Kind::any.
std::optional<Value> check_any(const Value& any_value, const Schema& schema, Diagnostics& diagnostics);

bool is_whole(const Value& value);

/// Whether `word` is made of letters, digits and _ and does not begin with a digit.
bool is_name(std::string_view word);
/// Names joined by dots.
bool is_signal_name(std::string_view word);

}  // namespace hil::config
