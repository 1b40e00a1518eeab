#include "rtstdb/query/id_order.hpp"

#include <bit>
#include <cstddef>
#include <utility>

namespace rtstdb::query {
namespace {

constexpr std::uint64_t bit_of(std::uint32_t place) noexcept {
  return std::uint64_t{1} << place % 64;
}

/// Calls `each` with the places of the bits that are set, ascending, and clears them.
template <class Each>
void take_bits(std::uint64_t& word, Each each) {
  for (std::uint64_t left = std::exchange(word, 0); left != 0; left &= left - 1)
    each(static_cast<std::uint32_t>(std::countr_zero(left)));
}

}  // namespace

void IdOrder::sort(std::span<std::uint32_t> ids) noexcept {
  Field& field = *field_;
  for (const std::uint32_t id : ids) {
    field.ids[id / 64] |= bit_of(id);
    field.groups[id / 64 / 64] |= bit_of(id / 64);
    field.all[id / 64 / 64 / 64] |= bit_of(id / 64 / 64);
  }
  std::size_t next = 0;
  for (std::uint32_t high = 0; high < field.all.size(); ++high) {
    take_bits(field.all[high], [&](std::uint32_t group_bit) {
      const std::uint32_t group = high * 64 + group_bit;
      take_bits(field.groups[group], [&](std::uint32_t word_bit) {
        const std::uint32_t word = group * 64 + word_bit;
        take_bits(field.ids[word], [&](std::uint32_t bit) { ids[next++] = word * 64 + bit; });
      });
    });
  }
}

}  // namespace rtstdb::query
