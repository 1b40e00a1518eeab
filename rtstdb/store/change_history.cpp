#include "rtstdb/store/change_history.hpp"

#include <rtstdb/result.hpp>

namespace rtstdb::store {

ChangeHistory::ChangeHistory(std::uint32_t max_entities, std::uint32_t retained_changes)
    : ring_(retained_changes), chains_(max_entities) {
  RTSTDB_ASSERT(retained_changes >= 1, "no change is retained");
}

void ChangeHistory::record(Version version, std::uint32_t index, const EntityState& before) noexcept {
  ++newest_;
  Change& change = ring_[newest_ % ring_.size()];
  // Versions older than the overwritten change needed its row, so they can no longer be read.
  if (newest_ > ring_.size()) oldest_kept_ = change.version;
  Chain& chain = chains_[index];
  change.version = version;
  change.previous = chain.newest;
  change.index = index;
  change.before = before;
  chain.newest = newest_;
  if (++chain.since == changes_per_milestone) make_milestone(newest_, chain);
}

void ChangeHistory::make_milestone(std::uint64_t number, Chain& chain) noexcept {
  Change& change = ring_[number % ring_.size()];
  const std::uint64_t before = chain.milestone;
  chain.milestone = number;
  chain.since = 0;
  change.milestone_before = change.jump = in_ring(before) ? before : 0;
  change.milestones_before = 0;
  if (change.jump == 0) return;
  const Change& one = at(before);
  change.milestones_before = one.milestones_before + 1;
  if (!in_ring(one.jump) || !in_ring(at(one.jump).jump)) return;
  // Skew-binary rule: two jumps of equal length combine into one that spans both.
  const Change& two = at(one.jump);
  const std::uint32_t length = one.milestones_before - two.milestones_before;
  if (length == two.milestones_before - at(two.jump).milestones_before) change.jump = two.jump;
}

std::uint64_t ChangeHistory::oldest_milestone_after(Version version, std::uint64_t milestone) const noexcept {
  while (true) {
    const Change& one = at(milestone);
    if (is_after(version, one.jump))
      milestone = one.jump;
    else if (is_after(version, one.milestone_before))
      milestone = one.milestone_before;
    else
      return milestone;
  }
}

}  // namespace rtstdb::store
