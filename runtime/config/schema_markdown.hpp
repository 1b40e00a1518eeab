#pragma once
// The documentation of a configuration. It is made from the schema that checks the configuration, so the two
// always agree.

#include <string>

#include <hil/schema.hpp>

namespace hil::config {

/// Every key as one item of a nested Markdown list: its kind, range, default and sentence; below it what it
/// consists of.
std::string schema_to_markdown(const Schema& schema);

}  // namespace hil::config
