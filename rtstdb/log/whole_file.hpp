#pragma once
// Reads a whole file.

#include <cstddef>
#include <string_view>
#include <vector>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

DiskResult<std::vector<std::byte>> read_whole_file(Disk& disk, std::string_view name);

}  // namespace rtstdb::log
