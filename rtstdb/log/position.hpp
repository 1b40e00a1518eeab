#pragma once
// The position of a group in a log, existing or next to be written.

#include <cstdint>

namespace rtstdb::log {

struct Position {
  std::uint64_t segment = 0;  ///< 0: before the first one
  std::uint64_t offset = 0;
  std::uint64_t group = 1;
  std::uint64_t link = 0;  ///< of the group
};

}  // namespace rtstdb::log
