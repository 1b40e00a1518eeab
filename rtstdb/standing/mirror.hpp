#pragma once
// The follower's copy of the rows of one version, and the bounds of geometries.
//
// Threads: the follower's, but for add_geometry, which is any's.

#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include <rtstdb/geometry.hpp>

#include "rtstdb/standing/change_feed.hpp"
#include "rtstdb/standing/separation.hpp"

namespace rtstdb::standing {

class Mirror {
 public:
  explicit Mirror(std::uint32_t max_entities) : max_entities_(max_entities) {}

  /// So that add_geometry does not throw the next time.
  void make_room_for_geometry();
  /// Before the first row names it. In the order of ids.
  void add_geometry(const Bounds& bounds, bool deforms);

  VersionInfo version() const noexcept { return version_; }
  std::uint32_t max_entities() const noexcept { return max_entities_; }
  std::uint32_t index_limit() const noexcept { return static_cast<std::uint32_t>(rows_.size()); }
  /// Null when nobody lives there.
  const EntityState* row(std::uint32_t index) const noexcept {
    return index < rows_.size() && rows_[index].id.valid() ? &rows_[index] : nullptr;
  }
  const EntityState* find(EntityId id) const noexcept {
    const EntityState* state = row(id.index);
    return state != nullptr && state->id == id ? state : nullptr;
  }
  /// The entity has a geometry.
  EntityBox box(const EntityState& state, bool is_point) const noexcept;

  /// Brings the rows to a later version, and names each index that may stand differently to a question, once and ascending.
  void apply(std::span<const Change> changes, std::vector<std::uint32_t>& changed);
  /// The same by all rows of it. `shapes`: bounds of all geometries that deform.
  struct ShapeBounds {
    GeometryId geometry;
    Bounds bounds;
  };
  /// Which would change; then to carry it out.
  void compare(std::span<const EntityState> rows, std::span<const ShapeBounds> shapes,
               std::vector<std::uint32_t>& changed);
  void replace(VersionInfo version, std::span<const EntityState> rows, std::span<const ShapeBounds> shapes);

 private:
  struct Geometry {
    Bounds bounds;
    bool deforms = false;
    std::vector<std::uint32_t> shown_by;  ///< deforms: indices, some of which may show another one by now
  };
  void learn_geometries();
  void set_row(const EntityState& state);
  void name_users(const Geometry& geometry, std::uint32_t id, std::vector<std::uint32_t>& changed) const;

  std::uint32_t max_entities_;
  VersionInfo version_;
  std::vector<EntityState> rows_;
  std::vector<Geometry> geometries_;

  std::mutex added_mutex_;
  std::vector<Geometry> added_;  ///< not learnt yet
};

}  // namespace rtstdb::standing
