#pragma once
// One version of the world, read by index: a port, so that those who read rows need not know the store.
//
// Threads: as the implementation says. Pointers and spans stay valid until the store changes next; an
// executor lets others change it only inside ExecutorCallbacks (query/executor.hpp).

#include <cstdint>
#include <span>
#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::store {

/// The vertex positions of a geometry that deforms.
struct Shape {
  Version version = 0;  ///< the version that wrote them; 0: as the geometry was added
  std::span<const glm::vec3> positions_m;
};

/// A closed span of world times; first > last: empty.
struct TimeSpan {
  WorldTime first = WorldTime::max();
  WorldTime last = WorldTime::min();
};

/// The rows of one version, and the shapes of geometry that deforms.
class RowSource {
 public:
  virtual ~RowSource() = default;
  virtual Version version() const noexcept = 0;
  virtual WorldTime time() const noexcept = 0;
  /// The index of every live entity is below this.
  virtual std::uint32_t index_limit() const noexcept = 0;
  /// The state of the entity at `index` in this version; null: there is none.
  virtual const EntityState* row(std::uint32_t index) const noexcept = 0;
  /// Appends each index whose row differs between `other` (older or newer) and this version, and perhaps
  /// further ones. False: the difference is no longer known, every row may differ. Does not allocate when
  /// `indices` has capacity for index_limit() more.
  virtual bool changed_between(Version other, std::vector<std::uint32_t>& indices) const noexcept = 0;
  /// The shape in this version of a geometry that deforms.
  virtual Shape shape(GeometryId geometry) const noexcept = 0;

  /// The state of the live entity with this id; null: there is none.
  const EntityState* find(EntityId id) const noexcept {
    const EntityState* state = id.index < index_limit() ? row(id.index) : nullptr;
    return state != nullptr && state->id == id ? state : nullptr;
  }
};

}  // namespace rtstdb::store
