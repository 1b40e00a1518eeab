#pragma once
// A read-only database that holds a range of versions of a log (rtstdb/history.hpp).

#include <memory>

#include <rtstdb/database.hpp>

#include "rtstdb/log/stretch.hpp"

namespace rtstdb {

/// The options must have room for the range.
Result<std::unique_ptr<Database>> open_past(const DatabaseOptions& options, log::Stretch stretch);

}  // namespace rtstdb
