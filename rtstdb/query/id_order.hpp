#pragma once
// Puts entity indices in order: each sets its bit in a field, which is then read from its begin. Levels of
// bits above say which words to look at. For the short lists of single answers this is faster than to compare.

#include <array>
#include <cstdint>
#include <memory>
#include <span>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {

class IdOrder {
 public:
  IdOrder() : field_(std::make_unique<Field>()) {}

  /// Ascending. Each of them occurs once and is below max_entities. Does not allocate.
  void sort(std::span<std::uint32_t> ids) noexcept;

 private:
  static constexpr std::uint32_t bits = 64;
  static constexpr std::uint32_t words = max_entities / bits;
  /// All zero between calls.
  struct Field {
    std::array<std::uint64_t, words> ids{};
    std::array<std::uint64_t, words / bits> groups{};
    std::array<std::uint64_t, (words / bits + bits - 1) / bits> all{};
  };
  std::unique_ptr<Field> field_;
};

}  // namespace rtstdb::query
