#include "rtstdb/standing/change_feed.hpp"

#include <glm/common.hpp>

#include <rtstdb/result.hpp>

namespace rtstdb::standing {

void ChangeFeed::committed(const store::WriteSet& set) noexcept {
  if (!active_) return;
  const std::uint64_t first = pushed_.load(std::memory_order_relaxed);
  const std::uint64_t waiting = first - popped_.load(std::memory_order_acquire);
  const std::size_t count = set.writes.size() + set.shapes.size();
  if (gap_.load(std::memory_order_relaxed) || waiting + count > changes_.size()) {
    skipped_.fetch_add(1, std::memory_order_relaxed);
    if (!gap_.exchange(true, std::memory_order_release)) follower_wake_up_.notify();
    return;
  }
  std::uint64_t next = first;
  const auto put = [&]() -> Change& {
    Change& change = changes_[next++ % changes_.size()];
    change.version = {set.version, set.time};
    change.last = next == first + count;
    return change;
  };
  for (const store::ShapeWrite& write : set.shapes) {
    Change& change = put();
    change.kind = Change::Kind::shape;
    change.geometry = write.geometry;
    change.bounds = bounds(write.geometry, write.positions_m);
  }
  for (const store::Write& write : set.writes) {
    Change& change = put();
    change.kind = write.kind == store::WriteKind::remove ? Change::Kind::removed : Change::Kind::row;
    change.state = write.state;
  }
  pushed_.store(next, std::memory_order_release);
  follower_wake_up_.notify();
}

void ChangeFeed::start() noexcept {
  gap_.store(false, std::memory_order_relaxed);
  active_ = true;
}

Bounds ChangeFeed::bounds(GeometryId geometry, std::span<const glm::vec3> positions_m) const noexcept {
  const std::vector<std::uint32_t>& used = used_positions_[geometry.index];
  RTSTDB_ASSERT(!used.empty(), "no triangle of the geometry uses a position");
  Bounds made{positions_m[used.front()], positions_m[used.front()]};
  for (const std::uint32_t position : used) {
    made.minimum_m = glm::min(made.minimum_m, positions_m[position]);
    made.maximum_m = glm::max(made.maximum_m, positions_m[position]);
  }
  return made;
}

bool ChangeFeed::take_version(std::vector<Change>& changes) {
  changes.clear();
  const std::uint64_t end = pushed_.load(std::memory_order_acquire);
  std::uint64_t next = popped_.load(std::memory_order_relaxed);
  if (next == end) return false;
  do {
    changes.push_back(changes_[next % changes_.size()]);
  } while (!changes_[next++ % changes_.size()].last);
  popped_.store(next, std::memory_order_release);
  return true;
}

}  // namespace rtstdb::standing
