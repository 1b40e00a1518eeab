#pragma once
// The rows and shapes of one version, as the store holds them: nothing is copied.
//
// Threads: the store's. Lifetime: the store's. Pointers from row() hold until the store is changed next
// (stage, publish, settle, discard).

#include <cstdint>
#include <vector>

#include "rtstdb/store/row_source.hpp"

namespace rtstdb::store {

class Store;

class Snapshot final : public RowSource {
 public:
  Snapshot(const Store& store, VersionInfo version) : store_(&store), version_(version) {}

  Version version() const noexcept override { return version_.version; }
  WorldTime time() const noexcept override { return version_.time; }
  std::uint32_t index_limit() const noexcept override;
  /// Misuse once still_kept() is false.
  const EntityState* row(std::uint32_t index) const noexcept override;
  /// The state at the index; where no entity lives, an id with an invalid index and the generation that was given last. Not of a
  /// version that is staged (misuse).
  const EntityState& slot(std::uint32_t index) const noexcept;
  bool changed_between(Version other, std::vector<std::uint32_t>& indices) const noexcept override;
  /// Misuse for a version that was not read as one that has its shapes.
  Shape shape(GeometryId geometry) const noexcept override;

  /// False when later commits have overwritten what the version is read from, or when it was discarded.
  bool still_kept() const noexcept;

 private:
  const Store* store_;
  VersionInfo version_;
};

}  // namespace rtstdb::store
