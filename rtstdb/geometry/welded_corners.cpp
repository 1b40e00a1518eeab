#include "rtstdb/geometry/welded_corners.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace rtstdb {

std::vector<std::uint32_t> first_at_place(std::span<const glm::vec3> positions_m) {
  std::vector<std::uint32_t> order(positions_m.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::sort(order, [&](std::uint32_t a, std::uint32_t b) {
    return std::pair(place_of(positions_m[a]), a) < std::pair(place_of(positions_m[b]), b);
  });
  std::vector<std::uint32_t> first(positions_m.size());
  for (std::size_t i = 0; i < order.size(); ++i) {
    const bool is_first = i == 0 || place_of(positions_m[order[i - 1]]) != place_of(positions_m[order[i]]);
    first[order[i]] = is_first ? order[i] : first[order[i - 1]];
  }
  return first;
}

}  // namespace rtstdb
