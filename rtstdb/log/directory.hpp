#pragma once
// The names of the files of a log, and the listing of its directory.

#include <cstdint>
#include <string>
#include <vector>

#include "rtstdb/log/disk.hpp"

namespace rtstdb::log {

inline constexpr const char* lock_name = "lock";
std::string segment_name(std::uint64_t number);
std::string checkpoint_name(std::uint64_t number);
/// Temporary names while the files are written.
std::string unfinished_segment_name(std::uint64_t number);
std::string unfinished_checkpoint_name(std::uint64_t number);
/// A checkpoint that a salvage set aside.
std::string abandoned_checkpoint_name(std::uint64_t number);
std::string geometry_name(std::uint64_t number);

/// Numbers of the files by kind, ascending.
struct Listing {
  std::vector<std::uint64_t> segments;
  std::vector<std::uint64_t> checkpoints;
  std::vector<std::uint64_t> geometries;
  std::vector<std::uint64_t> unfinished_segments;
  std::vector<std::uint64_t> unfinished_checkpoints;
  std::vector<std::uint64_t> abandoned_checkpoints;
};

/// Files with other names are ignored.
DiskResult<Listing> list_log(Disk& disk);

}  // namespace rtstdb::log
