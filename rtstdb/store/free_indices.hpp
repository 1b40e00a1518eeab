#pragma once
// The set of free indices among 0..count-1, with access to the lowest: a bitmap with summary levels above it,
// so that each call takes a few word operations, whatever the count. Allocates only in the constructor.
// Threads: one.

#include <cstdint>
#include <optional>
#include <vector>

namespace rtstdb::store {

class FreeIndices {
 public:
  /// All indices are free. `count` >= 1.
  explicit FreeIndices(std::uint32_t count);

  /// Acquires the lowest free index; none if no index is free.
  std::optional<std::uint32_t> acquire_lowest() noexcept;
  /// Misuse: an index that is not free.
  void acquire(std::uint32_t index) noexcept;
  /// Misuse: an index that is free already.
  void release(std::uint32_t index) noexcept;

 private:
  /// levels_[0] has one bit for each index: 1 is free. A bit of the next level is 1 if the corresponding word
  /// of this level is not zero. The last level is one word.
  std::vector<std::vector<std::uint64_t>> levels_;
};

}  // namespace rtstdb::store
