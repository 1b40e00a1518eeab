#pragma once
// The rows that discarded versions wrote (versions that were staged and not published). An executor may have
// brought its copy of the rows to such a version, and needs to know which rows to restore. A ring of fixed
// size. Allocates only in the constructor.
// Threads: one.

#include <cstdint>
#include <vector>

#include <rtstdb/transaction.hpp>

namespace rtstdb::store {

class DiscardedRows {
 public:
  explicit DiscardedRows(std::uint32_t retained) : ring_(retained) {}

  /// Versions must not decrease.
  void record(Version version, std::uint32_t index) noexcept {
    Touched& touched = ring_[count_ % ring_.size()];
    if (count_ >= ring_.size()) newest_forgotten_ = touched.version;
    touched = {version, index};
    ++count_;
  }

  /// Whether all rows of that discarded version are still in the ring.
  bool remembers(Version version) const noexcept { return version > newest_forgotten_; }

  /// Calls visit(index) for each row that the version wrote.
  template <class Visit>
  void for_each_of(Version version, Visit visit) const noexcept {
    const std::uint64_t end = count_ > ring_.size() ? count_ - ring_.size() : 0;
    for (std::uint64_t number = count_; number > end; --number) {
      const Touched& touched = ring_[(number - 1) % ring_.size()];
      if (touched.version < version) return;
      if (touched.version == version) visit(touched.index);
    }
  }

 private:
  struct Touched {
    Version version = 0;
    std::uint32_t index = 0;
  };
  std::vector<Touched> ring_;
  std::uint64_t count_ = 0;
  Version newest_forgotten_ = 0;
};

}  // namespace rtstdb::store
