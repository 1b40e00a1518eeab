#include "rtstdb/query/point_order.hpp"

#include <glm/common.hpp>
#include <glm/ext/vector_uint3.hpp>

#include <algorithm>
#include <array>
#include <bit>

namespace rtstdb::query {
namespace {

constexpr std::uint32_t max_bits_per_axis = 5;

/// The bits of 0 to 31 with two zeros between neighbouring bits.
constexpr auto spaced_bits = [] {
  std::array<std::uint16_t, 1u << max_bits_per_axis> table{};
  for (std::uint32_t i = 0; i < table.size(); ++i) {
    for (std::uint32_t bit = 0; bit < max_bits_per_axis; ++bit)
      table[i] = static_cast<std::uint16_t>(table[i] | (i >> bit & 1u) << 3 * bit);
  }
  return table;
}();

/// Chosen so that a cell has about four points.
std::uint32_t bits_per_axis(std::size_t points) noexcept {
  const auto bits = static_cast<std::uint32_t>(std::bit_width(points));
  return bits < 2 ? 0 : std::min((bits - 2) / 3, max_bits_per_axis);
}

}  // namespace

PointOrder::PointOrder(std::uint32_t capacity)
    : cell_of_(capacity), ends_(std::size_t{1} << 3 * bits_per_axis(capacity)), order_(capacity) {}

std::span<const std::uint32_t> PointOrder::of(std::span<const Nearest> points) noexcept {
  return order(points, &Nearest::point_m);
}

std::span<const std::uint32_t> PointOrder::of(std::span<const Region> regions) noexcept {
  return order(regions, &Region::center_m);
}

template <class Element>
std::span<const std::uint32_t> PointOrder::order(std::span<const Element> points,
                                                 glm::vec3 Element::*point_m) noexcept {
  count_ = points.size();
  if (points.empty()) return {};
  glm::vec3 low = points[0].*point_m;
  glm::vec3 high = low;
  for (const Element& point : points) {
    low = glm::min(low, point.*point_m);
    high = glm::max(high, point.*point_m);
  }
  const std::uint32_t bits = bits_per_axis(points.size());
  const glm::vec3 last_cell(static_cast<float>((1u << bits) - 1));
  const glm::vec3 cells_per_m = (last_cell + 1.0f) / glm::max(high - low, 1e-30f);
  const auto ends = std::span(ends_).first(std::size_t{1} << 3 * bits);
  std::ranges::fill(ends, 0u);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::uvec3 cell(glm::min((points[i].*point_m - low) * cells_per_m, last_cell));
    cell_of_[i] =
        static_cast<std::uint16_t>(spaced_bits[cell.x] << 2 | spaced_bits[cell.y] << 1 | spaced_bits[cell.z]);
    ++ends[cell_of_[i]];
  }
  std::uint32_t begin = 0;
  for (std::uint32_t& end : ends) {
    const std::uint32_t count = end;
    end = begin;
    begin += count;
  }
  for (std::uint32_t i = 0; i < points.size(); ++i)
    order_[ends[cell_of_[i]]++] = i;
  return last();
}

}  // namespace rtstdb::query
