#pragma once
// An order in which near points are neighbours: searches that a device runs together then visit the same
// nodes and take about the same time. Points are sorted by the Morton code of their cell in a grid over all
// points, and within a cell by number. No answer depends on it.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include <rtstdb/query.hpp>

namespace rtstdb::query {

/// Prefetches the element that an iteration in this order reaches soon after `place`: such elements are
/// scattered in memory.
template <class Element>
void prefetch_ahead(std::span<Element> elements, std::span<const std::uint32_t> order,
                    std::size_t place) noexcept {
  constexpr std::size_t ahead = 16;
  constexpr int is_written = std::is_const_v<Element> ? 0 : 1;
  const auto bytes = std::as_bytes(elements.subspan(order[std::min(place + ahead, order.size() - 1)], 1));
  __builtin_prefetch(&bytes.front(), is_written);
  __builtin_prefetch(&bytes.back(), is_written);
}

class PointOrder {
 public:
  PointOrder() = default;
  explicit PointOrder(std::uint32_t capacity);

  /// The number of the point at each place; valid until the next call. At most `capacity` points with finite
  /// coordinates. Does not allocate.
  std::span<const std::uint32_t> of(std::span<const Nearest> points) noexcept;
  /// The same for regions, by their centres.
  std::span<const std::uint32_t> of(std::span<const Region> regions) noexcept;
  /// The result of the last call.
  std::span<const std::uint32_t> last() const noexcept { return {order_.data(), count_}; }

 private:
  template <class Element>
  std::span<const std::uint32_t> order(std::span<const Element> elements, glm::vec3 Element::*point) noexcept;

  std::vector<std::uint16_t> cell_of_;  // by point
  std::vector<std::uint32_t> ends_;     // by cell: first its size, then the end of what is placed
  std::vector<std::uint32_t> order_;
  std::size_t count_ = 0;
};

}  // namespace rtstdb::query
