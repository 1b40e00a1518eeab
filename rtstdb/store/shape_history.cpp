#include "rtstdb/store/shape_history.hpp"

#include <algorithm>
#include <utility>

#include <rtstdb/result.hpp>

namespace rtstdb::store {
namespace {

/// The slot of the shape that is `age` shapes older than the newest.
std::size_t slot_of(const ShapeHistory::Ring& kept, std::size_t age) noexcept {
  return (kept.newest + kept.versions.size() - age) % kept.versions.size();
}

}  // namespace

std::unique_ptr<ShapeHistory::Ring> ShapeHistory::make(std::span<const glm::vec3> positions_m,
                                                       std::uint32_t retained_shapes, Version made_by) {
  RTSTDB_ASSERT(retained_shapes >= 1, "no shape is retained");
  auto kept = std::make_unique<Ring>();
  kept->position_count = positions_m.size();
  kept->positions_m.resize(positions_m.size() * retained_shapes);
  kept->versions.resize(retained_shapes, made_by);
  std::ranges::copy(positions_m, kept->positions_m.begin());
  kept->count = 1;
  return kept;
}

void ShapeHistory::adopt(GeometryId geometry, std::unique_ptr<Ring> kept) noexcept {
  RTSTDB_ASSERT(geometry.index < kept_.size() && kept_[geometry.index] == nullptr,
                "the geometry is unknown, or has shapes already");
  kept_[geometry.index] = std::move(kept);
}

Shape ShapeHistory::at(GeometryId geometry, Version version) const noexcept {
  RTSTDB_ASSERT(deforms(geometry), "the geometry does not deform");
  const Ring& kept = *kept_[geometry.index];
  std::size_t age = 0;
  while (age < kept.count && kept.versions[slot_of(kept, age)] > version)
    ++age;
  RTSTDB_ASSERT(age < kept.count, "the version is older than the retained shapes");
  const std::size_t slot = slot_of(kept, age);
  return {kept.versions[slot],
          std::span(kept.positions_m).subspan(slot * kept.position_count, kept.position_count)};
}

bool ShapeHistory::keeps_after_one_more(Version version, GeometryId geometry) const noexcept {
  const Ring& kept = *kept_[geometry.index];
  if (kept.count < kept.versions.size()) return true;
  return kept.count > 1 && version >= kept.versions[slot_of(kept, kept.count - 2)];
}

void ShapeHistory::record(Version version, GeometryId geometry,
                          std::span<const glm::vec3> positions_m) noexcept {
  Ring& kept = *kept_[geometry.index];
  RTSTDB_ASSERT(
      positions_m.size() == kept.position_count && version >= kept.versions[kept.newest],
      "the number of positions is not that of the geometry, or the version is older than the newest");
  if (version != kept.versions[kept.newest]) {
    kept.newest = (kept.newest + 1) % kept.versions.size();
    kept.count = std::min(kept.count + 1, kept.versions.size());
  }
  kept.versions[kept.newest] = version;
  std::ranges::copy(
      positions_m, kept.positions_m.begin() + static_cast<std::ptrdiff_t>(kept.newest * kept.position_count));
  oldest_kept_ = std::max(oldest_kept_, kept.versions[slot_of(kept, kept.count - 1)]);
}

}  // namespace rtstdb::store
