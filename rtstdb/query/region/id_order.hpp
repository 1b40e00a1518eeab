#pragma once
// Sorts indices. In a short list, each index is placed by the number of smaller ones, without branches on
// their values. In a longer list, each index sets its bit in a bit field, which is then read in order; a
// second level has one bit per word that is not zero.

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <utility>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {

class IdOrder {
 public:
  IdOrder() : field_(std::make_unique<Field>()) {}

  /// Up to this length counting is faster.
  static constexpr std::size_t max_counted = 64;

  /// Calls `each` with the ids in ascending order, once per distinct id. They are below max_entities. Does
  /// not allocate.
  template <class Each>
  void ascending(std::span<const std::uint32_t> ids, Each each) noexcept {
    if (ids.size() <= max_counted)
      by_counting(ids, each);
    else
      by_bits(ids, each);
  }

 private:
  template <class Each>
  static void by_counting(std::span<const std::uint32_t> ids, Each each) noexcept {
    constexpr std::size_t vector_width = 8;
    static_assert(max_counted % vector_width == 0);
    // Signed, since processors before AVX-512 compare signed vectors alone. Entries behind the last id are
    // above all ids.
    std::array<std::int32_t, max_counted> keys;
    std::array<std::int32_t, max_counted> sorted;
    const std::size_t rounded = (ids.size() + vector_width - 1) / vector_width * vector_width;
    std::fill_n(keys.begin(), rounded, no_id);
    std::fill_n(sorted.begin(), rounded, no_id);
    std::ranges::transform(ids, keys.begin(), [](std::uint32_t id) { return static_cast<std::int32_t>(id); });
    for (std::size_t first = 0; first < rounded; first += vector_width) {
      std::array<std::int32_t, vector_width> below{};
      for (std::size_t other = 0; other < ids.size(); ++other) {
        for (std::size_t k = 0; k < vector_width; ++k)
          below[k] += keys[other] < keys[first + k] ? 1 : 0;
      }
      for (std::size_t k = 0; k < vector_width && first + k < ids.size(); ++k)
        sorted[static_cast<std::size_t>(below[k])] = keys[first + k];
    }
    // The entry of a duplicate stays empty.
    for (std::size_t k = 0; k < ids.size(); ++k) {
      if (sorted[k] != no_id) each(static_cast<std::uint32_t>(sorted[k]));
    }
  }

  template <class Each>
  void by_bits(std::span<const std::uint32_t> ids, Each each) noexcept {
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

  static constexpr std::int32_t no_id = std::numeric_limits<std::int32_t>::max();
  static_assert(max_entities <= no_id);

  static constexpr std::uint64_t bit_of(std::uint32_t place) noexcept {
    return std::uint64_t{1} << place % 64;
  }

  /// Calls `each` with the indices of the bits that are set, ascending, and clears them.
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
