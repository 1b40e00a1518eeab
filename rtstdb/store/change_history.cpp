#include "rtstdb/store/change_history.hpp"

#include <rtstdb/result.hpp>

namespace rtstdb::store {

ChangeHistory::ChangeHistory(std::uint32_t max_entities, std::uint32_t retained_changes)
    : ring_(retained_changes), newest_of_index_(max_entities, 0) {
  RTSTDB_ASSERT(retained_changes >= 1);
}

void ChangeHistory::record(Version version, std::uint32_t index, const EntityState& before) noexcept {
  ++newest_;
  Change& change = ring_[newest_ % ring_.size()];
  // The row that this slot kept was needed by versions older than the change; they can not be read any more.
  if (newest_ > ring_.size()) oldest_kept_ = change.version;
  change.version = version;
  change.previous = newest_of_index_[index];
  change.index = index;
  change.before = before;
  newest_of_index_[index] = newest_;
}

}  // namespace rtstdb::store
