#pragma once
// What commits change, from the threads that commit to the one that follows. A ring of fixed size: a version whose changes find no
// room is skipped, and all after it, until the follower has read a version whole and says go on.
//
// Threads: committed, start and stop are the engine's (whoever holds its lock); versions, in_gap and skipped the follower's.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "rtstdb/threads/bell.hpp"
#include "rtstdb/transaction/commit_listener.hpp"

namespace rtstdb::standing {

struct Change {
  enum class Kind : std::uint8_t { row, removed, shape } kind = Kind::row;
  bool last = false;  ///< of its version
  VersionInfo version;
  EntityState state;  ///< row; of removed the id alone
  GeometryId geometry;
  Bounds bounds;  ///< shape: of what its triangles use
};

class ChangeFeed final : public transaction::CommitListener {
 public:
  ChangeFeed(std::uint32_t max_geometries, threads::Bell& follower)
      : used_positions_(max_geometries), follower_(follower) {}
  /// So many changes can wait. Once, before it is started.
  void make_room(std::size_t changes) { changes_.resize(changes); }

  void committed(const store::WriteSet& set) noexcept override;
  /// From now on every commit is fed.
  void start() noexcept;
  void stop() noexcept { on_ = false; }
  /// A geometry deforms; its triangles use these positions, of which there is at least one. In setup.
  void keep_bounds(GeometryId geometry, std::vector<std::uint32_t> used_positions) noexcept {
    used_positions_[geometry.index] = std::move(used_positions);
  }
  /// Of the shape that a geometry has with these positions; misuse unless its bounds are kept.
  Bounds bounds(GeometryId geometry, std::span<const glm::vec3> positions_m) const noexcept;
  const std::vector<std::vector<std::uint32_t>>& used_positions() const noexcept { return used_positions_; }

  /// The changes of the oldest version that waits, in the order of its writes; false: there is none.
  bool take_version(std::vector<Change>& changes);
  /// What waits is of no use any more; after stop.
  void clear() noexcept { popped_.store(pushed_.load(std::memory_order_acquire), std::memory_order_release); }
  /// Whether versions have been skipped behind those that wait.
  bool in_gap() const noexcept { return gap_.load(std::memory_order_acquire); }
  std::uint64_t skipped() const noexcept { return skipped_.load(std::memory_order_relaxed); }

 private:
  std::vector<Change> changes_;
  std::vector<std::vector<std::uint32_t>> used_positions_;  ///< by geometry; none: it stays as it is
  threads::Bell& follower_;
  bool on_ = false;  ///< the engine's
  std::atomic<bool> gap_{false};
  std::atomic<std::uint64_t> skipped_{0};
  alignas(64) std::atomic<std::uint64_t> pushed_{0};
  alignas(64) std::atomic<std::uint64_t> popped_{0};
};

}  // namespace rtstdb::standing
