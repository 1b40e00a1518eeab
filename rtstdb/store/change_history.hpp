#pragma once
// The most recent row changes, each with the row as it was before the change: the source of older versions. A
// ring of fixed size. The changes of one index form a chain, newest first. Every 16th change of a chain is a
// milestone; from one milestone others are reached by jump pointers in the skew-binary number system (Myers,
// "An applicative random-access stack", 1983). Allocates only in the constructor. Threads: one.

#include <algorithm>
#include <cstdint>
#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::store {

class ChangeHistory {
 public:
  ChangeHistory(std::uint32_t max_entities, std::uint32_t retained_changes);

  /// Sets the oldest readable version. To be called before the first change.
  void begin_at(Version version) noexcept { oldest_kept_ = version; }

  /// Records that `version` changed the row at `index`, which was `before`. Versions must not decrease; at
  /// most one change for each index and version.
  void record(Version version, std::uint32_t index, const EntityState& before) noexcept;

  /// The row at `index` in `version`, which must be kept; `current` is the newest row. The number of steps
  /// grows with the logarithm of the number of changes of that row after the version.
  const EntityState& state_at(Version version, std::uint32_t index,
                              const EntityState& current) const noexcept {
    const Chain& chain = chains_[index];
    std::uint64_t number = chain.newest;
    if (!is_after(version, number)) return current;
    if (is_after(version, chain.milestone)) number = oldest_milestone_after(version, chain.milestone);
    while (is_after(version, at(number).previous))
      number = at(number).previous;
    return at(number).before;
  }

  /// The oldest version that can still be read.
  Version oldest_kept() const noexcept { return oldest_kept_; }

  /// Whether a version that is kept now will still be kept after `more` further changes.
  bool keeps_after(Version version, std::size_t more) const noexcept {
    const std::uint64_t last = newest_ + more;
    if (last <= ring_.size()) return true;
    return more <= ring_.size() && version >= std::max(oldest_kept_, at(last - ring_.size()).version);
  }

  /// Calls visit(index) for every change made by a version in (after, up_to]; `after` must be kept.
  template <class Visit>
  void for_each_between(Version after, Version up_to, Visit visit) const noexcept {
    for (std::uint64_t number = newest_; in_ring(number) && at(number).version > after; --number) {
      if (at(number).version <= up_to) visit(at(number).index);
    }
  }

 private:
  struct Change {
    Version version = 0;
    std::uint64_t previous = 0;  ///< number of the next older change of the same index; 0: none
    // For a milestone: numbers of older milestones of the same index; 0: none.
    std::uint64_t milestone_before = 0, jump = 0;
    std::uint32_t milestones_before = 0;  ///< number of older milestones, counted from the oldest in the ring
    std::uint32_t index = 0;
    EntityState before;
  };

  /// The changes of one index.
  struct Chain {
    std::uint64_t newest = 0;     ///< number of the newest change
    std::uint64_t milestone = 0;  ///< number of the newest milestone
    std::uint32_t since = 0;      ///< changes since that milestone
  };
  static constexpr std::uint32_t changes_per_milestone = 16;

  // Changes are numbered from 1. Change n is in slot n mod size until change n + size overwrites it.
  const Change& at(std::uint64_t number) const noexcept { return ring_[number % ring_.size()]; }
  bool in_ring(std::uint64_t number) const noexcept { return number != 0 && number + ring_.size() > newest_; }
  /// Whether the change is newer than the version. Changes that left the ring are not newer than any kept
  /// version.
  bool is_after(Version version, std::uint64_t number) const noexcept {
    return in_ring(number) && at(number).version > version;
  }
  /// The search starts at a milestone that is newer than the version.
  std::uint64_t oldest_milestone_after(Version version, std::uint64_t milestone) const noexcept;
  void make_milestone(std::uint64_t number, Chain& chain) noexcept;

  std::vector<Change> ring_;
  std::vector<Chain> chains_;
  std::uint64_t newest_ = 0;
  Version oldest_kept_ = 0;
};

}  // namespace rtstdb::store
