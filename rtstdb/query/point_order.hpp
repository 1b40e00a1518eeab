#pragma once
// An order in which points that are near to one another stand next to one another: searches that a device
// does side by side then meet the same nodes, and take about as long. By the Morton number of each point's
// cell in a grid over all of them; within a cell as they came. It changes no answer.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include <rtstdb/query.hpp>

namespace rtstdb::query {

/// Prefetches the element that an iteration in this order reaches soon after `place`: such elements are scattered in memory.
template <class Element>
void call_ahead(std::span<Element> elements, std::span<const std::uint32_t> order,
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

  /// Which point stands at each place; valid until the next call. At most `capacity` points with finite
  /// coordinates. Does not allocate.
  std::span<const std::uint32_t> of(std::span<const Nearest> points) noexcept;
  /// Of regions by their centres.
  std::span<const std::uint32_t> of(std::span<const Region> regions) noexcept;
  /// What the last call gave.
  std::span<const std::uint32_t> last() const noexcept { return {order_.data(), count_}; }

 private:
  template <class Element>
  std::span<const std::uint32_t> order(std::span<const Element> elements, glm::vec3 Element::*point) noexcept;

  std::vector<std::uint16_t> cell_of_;  // by point
  std::vector<std::uint32_t> ends_;     // by cell: first how many, then where the next of it goes
  std::vector<std::uint32_t> order_;
  std::size_t count_ = 0;
};

}  // namespace rtstdb::query
