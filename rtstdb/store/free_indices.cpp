#include "rtstdb/store/free_indices.hpp"

#include <bit>
#include <cstddef>

#include <rtstdb/result.hpp>

namespace rtstdb::store {

namespace {

constexpr std::uint32_t word_bits = 64;

std::uint64_t bit_of(std::uint32_t index) {
  return std::uint64_t{1} << (index % word_bits);
}

std::vector<std::uint64_t> all_set(std::uint32_t bits) {
  std::vector<std::uint64_t> words((bits + word_bits - 1) / word_bits, ~std::uint64_t{0});
  if (bits % word_bits != 0) words.back() = bit_of(bits) - 1;
  return words;
}

}  // namespace

FreeIndices::FreeIndices(std::uint32_t count) {
  RTSTDB_ASSERT(count >= 1, "there are no indices");
  levels_.push_back(all_set(count));
  while (levels_.back().size() > 1) {
    levels_.push_back(all_set(static_cast<std::uint32_t>(levels_.back().size())));
  }
}

std::optional<std::uint32_t> FreeIndices::acquire_lowest() noexcept {
  if (levels_.back()[0] == 0) return std::nullopt;
  std::uint32_t index = 0;
  for (std::size_t level = levels_.size(); level-- > 0;) {
    index = index * word_bits + static_cast<std::uint32_t>(std::countr_zero(levels_[level][index]));
  }
  acquire(index);
  return index;
}

void FreeIndices::acquire(std::uint32_t index) noexcept {
  RTSTDB_ASSERT(index / word_bits < levels_[0].size() && (levels_[0][index / word_bits] & bit_of(index)) != 0,
                "the index is in use or beyond the last one");
  for (auto& words : levels_) {
    words[index / word_bits] &= ~bit_of(index);
    if (words[index / word_bits] != 0) return;
    index /= word_bits;
  }
}

void FreeIndices::release(std::uint32_t index) noexcept {
  RTSTDB_ASSERT(index / word_bits < levels_[0].size() && (levels_[0][index / word_bits] & bit_of(index)) == 0,
                "the index is free or beyond the last one");
  for (auto& words : levels_) {
    const bool was_empty = words[index / word_bits] == 0;
    words[index / word_bits] |= bit_of(index);
    if (!was_empty) return;
    index /= word_bits;
  }
}

}  // namespace rtstdb::store
