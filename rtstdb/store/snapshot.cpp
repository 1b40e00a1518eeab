#include "rtstdb/store/snapshot.hpp"

#include "rtstdb/store/store.hpp"

namespace rtstdb::store {

std::uint32_t Snapshot::index_limit() const noexcept {
  return store_->index_limit_;
}

const EntityState* Snapshot::row(std::uint32_t index) const noexcept {
  return store_->row(version_.version, index);
}

const EntityState& Snapshot::slot(std::uint32_t index) const noexcept {
  return store_->slot(version_.version, index);
}

bool Snapshot::changed_between(Version other, std::vector<std::uint32_t>& indices) const noexcept {
  return store_->changed_between(version_.version, other, indices);
}

Shape Snapshot::shape(GeometryId geometry) const noexcept {
  return store_->shape(version_.version, geometry);
}

bool Snapshot::still_kept() const noexcept {
  return store_->keeps(version_.version);
}

}  // namespace rtstdb::store
