#pragma once
// The queue of changes from the committing threads to the follower. A ring of fixed size. If the changes of a
// version do not fit, that version and all later ones are skipped until the follower has read a version whole
// and calls start again.
//
// Threads: committed, start and stop are called by the engine (the thread that holds its lock); take_version,
// in_gap and skipped by the follower.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "rtstdb/threads/event_count.hpp"
#include "rtstdb/transaction/commit_listener.hpp"

namespace rtstdb::standing {

struct Change {
  enum class Kind : std::uint8_t { row, removed, shape } kind = Kind::row;
  bool last = false;  ///< the last change of its version
  VersionInfo version;
  EntityState state;  ///< row; for removed, only the id
  GeometryId geometry;
  Bounds bounds;  ///< shape: bounds of the positions that triangles use
};

class ChangeFeed final : public transaction::CommitListener {
 public:
  ChangeFeed(std::uint32_t max_geometries, threads::EventCount& follower_wake_up)
      : used_positions_(max_geometries), follower_wake_up_(follower_wake_up) {}
  /// Sets the capacity. Once, before the first start.
  void make_space(std::size_t changes) { changes_.resize(changes); }

  void committed(const store::WriteSet& set) noexcept override;
  /// From now on, every commit is queued.
  void start() noexcept;
  void stop() noexcept { active_ = false; }
  /// Registers a deforming geometry, whose triangles use these positions (at least one). Setup.
  void keep_bounds(GeometryId geometry, std::vector<std::uint32_t> used_positions) noexcept {
    used_positions_[geometry.index] = std::move(used_positions);
  }
  /// Bounds of a deforming geometry with these positions. Misuse unless it was registered.
  Bounds bounds(GeometryId geometry, std::span<const glm::vec3> positions_m) const noexcept;
  const std::vector<std::vector<std::uint32_t>>& used_positions() const noexcept { return used_positions_; }

  /// Takes the changes of the oldest queued version, in the order of its writes; false: none is queued.
  bool take_version(std::vector<Change>& changes);
  /// Removes all queued changes. After stop.
  void clear() noexcept { popped_.store(pushed_.load(std::memory_order_acquire), std::memory_order_release); }
  /// Whether versions after the queued ones have been skipped.
  bool in_gap() const noexcept { return gap_.load(std::memory_order_acquire); }
  std::uint64_t skipped() const noexcept { return skipped_.load(std::memory_order_relaxed); }

 private:
  std::vector<Change> changes_;
  std::vector<std::vector<std::uint32_t>> used_positions_;  ///< by geometry; empty: it does not deform
  threads::EventCount& follower_wake_up_;
  bool active_ = false;  ///< accessed by the engine only
  std::atomic<bool> gap_{false};
  std::atomic<std::uint64_t> skipped_{0};
  alignas(64) std::atomic<std::uint64_t> pushed_{0};
  alignas(64) std::atomic<std::uint64_t> popped_{0};
};

}  // namespace rtstdb::standing
