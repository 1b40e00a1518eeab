#pragma once
// The rows and shapes of one version, read from the store without a copy.
//
// Threads and lifetime: those of the store. Pointers from row() are valid until the next call of stage,
// publish, complete_commit or discard.

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
  /// Misuse if still_kept() is false.
  const EntityState* row(std::uint32_t index) const noexcept override;
  /// The state at the index. If no entity lives there, its id has an invalid index and the last generation of
  /// that index. Misuse for a staged version.
  const EntityState& slot(std::uint32_t index) const noexcept;
  bool changed_between(Version other, std::vector<std::uint32_t>& indices) const noexcept override;
  /// Misuse unless the version was read with ReadFor::rows_and_shapes.
  Shape shape(GeometryId geometry) const noexcept override;

  /// False if later commits have overwritten the history that the version needs, or if it was discarded.
  bool still_kept() const noexcept;

 private:
  const Store* store_;
  VersionInfo version_;
};

}  // namespace rtstdb::store
