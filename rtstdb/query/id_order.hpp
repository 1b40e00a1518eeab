#pragma once
// Puts indices in order: each sets its bit in a field, which is then read from its begin. A bit above
// each word says whether to look at it. For the short lists of single answers this is faster than to compare.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {

class IdOrder {
 public:
  IdOrder() : field_(std::make_unique<Field>()) {}

  /// Calls `each` with the ids, ascending. Each of them occurs once and is below max_entities. Does not
  /// allocate.
  template <class Each>
  void ascending(std::span<const std::uint32_t> ids, Each each) noexcept {
    Field& field = *field_;
    std::uint32_t last = 0;
    for (const std::uint32_t id : ids) {
      field.ids[id / 64] |= bit_of(id);
      field.words[id / 64 / 64] |= bit_of(id / 64);
      last = std::max(last, id);
    }
    for (std::uint32_t high = 0; high <= last / 64 / 64; ++high) {
      take_bits(field.words[high], [&](std::uint32_t bit) {
        const std::uint32_t word = high * 64 + bit;
        take_bits(field.ids[word], [&](std::uint32_t low) { each(word * 64 + low); });
      });
    }
  }

 private:
  static constexpr std::uint64_t bit_of(std::uint32_t place) noexcept {
    return std::uint64_t{1} << place % 64;
  }

  /// Calls `each` with the places of the bits that are set, ascending, and clears them.
  template <class Each>
  static void take_bits(std::uint64_t& word, Each each) {
    for (std::uint64_t left = std::exchange(word, 0); left != 0; left &= left - 1)
      each(static_cast<std::uint32_t>(std::countr_zero(left)));
  }

  /// All zero between calls.
  struct Field {
    std::array<std::uint64_t, max_entities / 64> ids{};
    std::array<std::uint64_t, max_entities / 64 / 64> words{};
  };
  std::unique_ptr<Field> field_;
};

}  // namespace rtstdb::query
