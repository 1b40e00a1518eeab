#pragma once
// Where a group lies, or would lie if there were one.

#include <cstdint>

namespace rtstdb::log {

struct Position {
  std::uint64_t segment = 0;  ///< 0: before the first one
  std::uint64_t offset = 0;
  std::uint64_t group = 1;
  std::uint64_t link = 0;  ///< that the group has
};

}  // namespace rtstdb::log
