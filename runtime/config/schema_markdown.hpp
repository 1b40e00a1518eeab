#pragma once
// The documentation of a configuration, made from the schema that checks it, so that the two can not
// disagree.

#include <string>

#include "runtime/config/schema.hpp"

namespace hil::config {

/// Every key as one item of a nested Markdown list: its kind, range, default and sentence; below it what it
/// consists of.
std::string schema_to_markdown(const Schema& schema);

}  // namespace hil::config
