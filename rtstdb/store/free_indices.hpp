#pragma once
// Which of the indices 0..count-1 are free, lowest first: a bitmap with summary levels above it, so that
// every call takes a handful of word operations whatever the count. Allocates in the constructor alone. One
// thread.

#include <cstdint>
#include <optional>
#include <vector>

namespace rtstdb::store {

class FreeIndices {
 public:
  /// All free. `count` >= 1.
  explicit FreeIndices(std::uint32_t count);

  /// The lowest free index, now taken; none when all are.
  std::optional<std::uint32_t> take_lowest() noexcept;
  /// Misuse: an index that is not free.
  void take(std::uint32_t index) noexcept;
  /// Misuse: an index that is free already.
  void give_back(std::uint32_t index) noexcept;

 private:
  /// levels_[0] has a bit per index; a bit of the next level says that a word of this one is not zero. The
  /// last level is one word.
  std::vector<std::vector<std::uint64_t>> levels_;
};

}  // namespace rtstdb::store
