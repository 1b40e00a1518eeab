#pragma once
// The follower's copy of the rows of one version, and the bounds of all geometries.
//
// Threads: the follower; any thread calls make_space_for_geometry and add_geometry.

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

  /// Allocates memory so that the next add_geometry does not throw.
  void make_space_for_geometry();
  /// To be called in the order of ids, before the first row with the geometry.
  void add_geometry(const Bounds& bounds, bool deforms);

  VersionInfo version() const noexcept { return version_; }
  std::uint32_t max_entities() const noexcept { return max_entities_; }
  std::uint32_t index_limit() const noexcept { return static_cast<std::uint32_t>(rows_.size()); }
  /// Null: no entity lives there.
  const EntityState* row(std::uint32_t index) const noexcept {
    return index < rows_.size() && rows_[index].id.valid() ? &rows_[index] : nullptr;
  }
  const EntityState* find(EntityId id) const noexcept {
    const EntityState* state = row(id.index);
    return state != nullptr && state->id == id ? state : nullptr;
  }
  /// The scaled bounds of an entity, which must have a geometry.
  EntityBox box(const EntityState& state, bool is_point) const noexcept;

  /// Advances to a later version. `changed`: each index whose entity may have another relation to a query,
  /// once, ascending.
  void apply(std::span<const Change> changes, std::vector<std::uint32_t>& changed);
  struct ShapeBounds {
    GeometryId geometry;
    Bounds bounds;
  };
  /// The same with all rows of a later version and the bounds of all deforming geometries: compare determines
  /// `changed`, then replace takes the rows over.
  void compare(std::span<const EntityState> rows, std::span<const ShapeBounds> shapes,
               std::vector<std::uint32_t>& changed);
  void replace(VersionInfo version, std::span<const EntityState> rows, std::span<const ShapeBounds> shapes);

 private:
  struct Geometry {
    Bounds bounds;
    bool deforms = false;
    std::vector<std::uint32_t>
        users;  ///< deforms: entities with this geometry; may contain others that had it before
  };
  void take_added_geometries();
  void set_row(const EntityState& state);
  void append_users(const Geometry& geometry, std::uint32_t id, std::vector<std::uint32_t>& changed) const;

  std::uint32_t max_entities_;
  VersionInfo version_;
  std::vector<EntityState> rows_;
  std::vector<Geometry> geometries_;

  std::mutex added_mutex_;
  std::vector<Geometry> added_;  ///< not yet taken over into geometries_
};

}  // namespace rtstdb::standing
