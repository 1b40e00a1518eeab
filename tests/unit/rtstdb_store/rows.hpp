#pragma once
// Rows and write sets for tests of the store.

#include <cstdint>
#include <initializer_list>
#include <optional>

#include "rtstdb/store/store.hpp"

namespace rtstdb::store::test {

/// Geometries below this exist.
inline constexpr std::uint32_t known_geometries = 3;

inline StoreOptions options(std::uint32_t max_entities, std::uint32_t retained_changes = 64) {
  return {max_entities, retained_changes, [](GeometryId id) { return id.index < known_geometries; }};
}

/// A row that `x` distinguishes from others.
inline EntityRow row_at(double x, std::uint32_t geometry = 0) {
  EntityRow row;
  row.geometry = GeometryId{geometry};
  row.mask = static_cast<std::uint32_t>(x);
  row.motion.p_world_m = {x, 2 * x, -x};
  row.motion.v_world_mps = {1.0, x, 0.0};
  return row;
}

/// Only the default material exists.
inline EntityRow of_material(std::uint32_t index) {
  EntityRow row = row_at(1);
  row.material = {index};
  return row;
}

/// No light exists.
inline EntityRow with_light(std::uint32_t index) {
  EntityRow row = row_at(1);
  row.light = {index};
  return row;
}

inline Write create(const EntityRow& row) {
  return {WriteKind::create, {EntityId{}, row, 0}};
}
inline Write update(EntityId id, const EntityRow& row) {
  return {WriteKind::update, {id, row, 0}};
}
inline Write update_motion(EntityId id, const Motion& motion) {
  Write write{WriteKind::update_motion, {id, EntityRow{}, 0}};
  write.state.row.motion = motion;
  return write;
}
inline Write remove(EntityId id) {
  return {WriteKind::remove, {id, EntityRow{}, 0}};
}

inline WriteSet set_of(std::int64_t time_ns, std::initializer_list<Write> writes) {
  return {0, world_time_ns(time_ns), writes};
}

/// Stages, publishes and completes the commit; returns the fault, if any.
inline std::optional<BadInput> commit(Store& store, WriteSet& set) {
  if (auto fault = store.stage(set)) return fault;
  store.publish();
  store.complete_commit();
  return std::nullopt;
}
inline std::optional<BadInput> commit(Store& store, WriteSet&& set) {
  return commit(store, set);
}

inline bool same(const Motion& a, const Motion& b) {
  return a.p_world_m == b.p_world_m && a.q_world == b.q_world && a.v_world_mps == b.v_world_mps &&
         a.w_world_radps == b.w_world_radps && a.valid_from == b.valid_from;
}
inline bool same(const EntityState& a, const EntityState& b) {
  return a.id == b.id && a.written_by == b.written_by && a.row.geometry == b.row.geometry &&
         a.row.scale == b.row.scale && a.row.mask == b.row.mask && a.row.material == b.row.material &&
         a.row.light == b.row.light && same(a.row.motion, b.row.motion);
}

}  // namespace rtstdb::store::test
