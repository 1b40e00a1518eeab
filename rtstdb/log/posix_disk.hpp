#pragma once
// A directory of the machine's own file system behind the port.

#include <filesystem>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

/// The directory is made where it is not there; its parent must be. Must outlive its files and its lock.
DiskResult<std::unique_ptr<Disk>> open_directory(const std::filesystem::path& directory);
/// To read alone: the directory must be there.
DiskResult<std::unique_ptr<Disk>> open_existing_directory(const std::filesystem::path& directory);

/// What a new database is called: random, not zero.
std::uint64_t new_database_id();

}  // namespace rtstdb::log
