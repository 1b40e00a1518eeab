#pragma once
// Which rows versions touched that were computed on and then not published. An executor may have brought its
// copy of the rows to such a version, and must learn what to put back. A ring of fixed size; allocates in the
// constructor alone. One thread.

#include <cstdint>
#include <vector>

#include <rtstdb/transaction.hpp>

namespace rtstdb::store {

class DiscardedRows {
 public:
  explicit DiscardedRows(std::uint32_t retained) : ring_(retained) {}

  /// Versions never go back.
  void record(Version version, std::uint32_t index) noexcept {
    Touched& touched = ring_[count_ % ring_.size()];
    if (count_ >= ring_.size()) newest_forgotten_ = touched.version;
    touched = {version, index};
    ++count_;
  }

  /// Whether everything that the discarded version touched is still remembered.
  bool remembers(Version version) const noexcept { return version > newest_forgotten_; }

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
