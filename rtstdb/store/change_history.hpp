#pragma once
// The last row changes, each with the row as it was before: what older versions are read from. A ring of
// fixed size; the newest change of every index starts a chain to its older ones. Every 16th of a chain is a milestone, and from one
// milestone others are reached in jumps, by skew-binary numbers (Myers, "An applicative random-access stack", 1983). Allocates in the
// constructor alone. One thread.

#include <algorithm>
#include <cstdint>
#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::store {

class ChangeHistory {
 public:
  ChangeHistory(std::uint32_t max_entities, std::uint32_t retained_changes);

  /// No version before this one can be read. Before the first change.
  void begin_at(Version version) noexcept { oldest_kept_ = version; }

  /// Version `version` changes the row at `index`, which was `before`. Versions never go back; one change per
  /// index and version.
  void record(Version version, std::uint32_t index, const EntityState& before) noexcept;

  /// The row at `index` in `version`, which is kept; `current` is the newest. The steps that it takes grow with the logarithm of how many
  /// changes newer than the version that row has.
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

  /// Whether a version that is kept now will be after `more` further changes.
  bool keeps_after(Version version, std::size_t more) const noexcept {
    const std::uint64_t last = newest_ + more;
    if (last <= ring_.size()) return true;
    return more <= ring_.size() && version >= std::max(oldest_kept_, at(last - ring_.size()).version);
  }

  /// Calls visit(index) for every change that a version in (after, up_to] made; `after` is kept.
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
    // Of a milestone. Numbers of older ones of the same index; 0: none.
    std::uint64_t milestone_before = 0, jump = 0;
    std::uint32_t milestones_before = 0;  ///< how many there are, from one on that had none in the ring
    std::uint32_t index = 0;
    EntityState before;
  };

  /// Of one index.
  struct Chain {
    std::uint64_t newest = 0;     ///< number of its newest change
    std::uint64_t milestone = 0;  ///< and of its newest milestone
    std::uint32_t since = 0;      ///< changes after that
  };
  static constexpr std::uint32_t changes_per_milestone = 16;

  // Changes are numbered from 1 on; number n lies in slot n mod size until n + size overwrites it.
  const Change& at(std::uint64_t number) const noexcept { return ring_[number % ring_.size()]; }
  bool in_ring(std::uint64_t number) const noexcept { return number != 0 && number + ring_.size() > newest_; }
  /// Those that are not in the ring any more were made by versions up to the oldest that is kept.
  bool is_after(Version version, std::uint64_t number) const noexcept {
    return in_ring(number) && at(number).version > version;
  }
  /// From a milestone that is after the version.
  std::uint64_t oldest_milestone_after(Version version, std::uint64_t milestone) const noexcept;
  void make_milestone(std::uint64_t number, Chain& chain) noexcept;

  std::vector<Change> ring_;
  std::vector<Chain> chains_;
  std::uint64_t newest_ = 0;
  Version oldest_kept_ = 0;
};

}  // namespace rtstdb::store
