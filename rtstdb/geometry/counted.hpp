#pragma once
// A count with its noun, for error texts.

#include <cstdint>
#include <string>

namespace rtstdb {

/// "1 corner", "2 corners".
inline std::string counted(std::uint64_t count, const std::string& noun) {
  return std::to_string(count) + " " + noun + (count == 1 ? "" : "s");
}

}  // namespace rtstdb
