#pragma once
// The one way from a user's YAML to checked values.
//
// One pass finds all mistakes of a file, each with its place. Three mistakes hide the rest: a file that can
// not be read, bytes that are not text, and text that is not YAML. Time and memory are bounded for any file:
// at most max_file_bytes (1 MiB; source_text.hpp), 64 levels, 250'000 values with aliases written out
// (tree.hpp) and Diagnostics::capacity mistakes.
//
// Threads: pure functions of the file system and their arguments; a Diagnostics belongs to one thread.

#include <optional>
#include <span>
#include <string>
#include <string_view>

#include <hil/diagnostics.hpp>
#include <hil/schema.hpp>

namespace hil::config {

/// The document in the file, with the overrides (overrides.hpp) applied first, in their order. Empty when
/// there was any mistake; `path` stands in places as it is given.
std::optional<Value> parse_file(const std::string& path, const Schema& schema, Diagnostics& diagnostics,
                                std::span<const std::string> overrides = {});

/// The same for text; `name` stands in places, and relative paths start at the current directory.
std::optional<Value> parse_text(const std::string& name, std::string_view text, const Schema& schema,
                                Diagnostics& diagnostics, std::span<const std::string> overrides = {});

/// The second parse of a value of Kind::any, when its schema is known.
std::optional<Value> parse_value(const Value& any_value, const Schema& schema, Diagnostics& diagnostics);

}  // namespace hil::config
