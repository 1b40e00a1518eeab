#pragma once
// A database that begins and ends with a stretch of a log.

#include <memory>

#include <rtstdb/database.hpp>

#include "rtstdb/log/stretch.hpp"

namespace rtstdb {

/// The options have room for the stretch.
Result<std::unique_ptr<Database>> open_past(const DatabaseOptions& options, log::Stretch stretch);

}  // namespace rtstdb
