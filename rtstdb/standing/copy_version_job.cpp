#include "rtstdb/standing/copy_version_job.hpp"

#include <algorithm>

namespace rtstdb::standing {

CopyVersionJob::CopyVersionJob(ChangeFeed& feed, std::size_t space) : feed_(feed) {
  rows_.reserve(space);
  shapes_.reserve(feed.used_positions().size());
}

void CopyVersionJob::begin(const store::Store& store) noexcept {
  snapshot_ = store.latest_snapshot();
  ++attempts_;
  next_index_ = 0;
  rows_.clear();
  shapes_.clear();
  for (std::uint32_t index = 0; index < feed_.used_positions().size(); ++index) {
    if (feed_.used_positions()[index].empty()) continue;
    const GeometryId geometry{index};
    shapes_.push_back({geometry, feed_.bounds(geometry, snapshot_->shape(geometry).positions_m)});
  }
}

bool CopyVersionJob::step(const store::Store& store) noexcept {
  if (!snapshot_) feed_.start();
  if (!snapshot_ || !snapshot_->still_kept()) begin(store);
  const std::uint32_t limit = snapshot_->index_limit();
  const std::uint32_t end =
      attempts_ > max_sliced_attempts ? limit : std::min(limit, next_index_ + indices_per_step);
  for (; next_index_ < end; ++next_index_) {
    if (const EntityState* state = snapshot_->row(next_index_)) rows_.push_back(*state);
  }
  return next_index_ == limit;
}

}  // namespace rtstdb::standing
