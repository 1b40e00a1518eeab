#include "rtstdb/transaction/snapshot_job.hpp"

#include <algorithm>
#include <utility>
#include <variant>

namespace rtstdb::transaction {

bool SnapshotJob::step(const store::Store& store) noexcept {
  if (!snapshot_ || !snapshot_->still_kept()) {
    // The first attempt, or the version is no longer kept. Only ReadAt::latest may move on to another
    // version.
    const ReadAt again =
        snapshot_ && read_at_.kind != ReadAt::Kind::latest ? ReadAt::pinned(snapshot_->version()) : read_at_;
    const auto found = store.read(again);
    if (const auto* fault = std::get_if<BadInput>(&found)) {
      fault_ = *fault;
      return true;
    }
    snapshot_ = *std::get_if<store::Snapshot>(&found);
    ++attempts_;
    next_index_ = 0;
    states_.clear();
  }
  const std::uint32_t limit = snapshot_->index_limit();
  const std::uint32_t end =
      attempts_ > attempts_in_slices ? limit : std::min(limit, next_index_ + indices_per_step);
  for (; next_index_ < end; ++next_index_) {
    if (const EntityState* state = snapshot_->row(next_index_)) states_.push_back(*state);
  }
  return next_index_ == limit;
}

Result<std::vector<EntityState>> SnapshotJob::take() && {
  if (fault_) return Error{ErrorCode::bad_input, describe(*fault_)};
  return std::move(states_);
}

}  // namespace rtstdb::transaction
