#include "rtstdb/log/world.hpp"

#include <algorithm>
#include <utility>

#include "rtstdb/log/stored_row.hpp"

namespace rtstdb::log {
namespace {

bool same(const LoggedGeometry& a, const LoggedGeometry& b) {
  return a.id == b.id && a.name == b.name && a.file == b.file && a.file_checksum == b.file_checksum &&
         a.options.deforms == b.options.deforms && a.options.retained_shapes == b.options.retained_shapes &&
         a.options.rebuild_growth == b.options.rebuild_growth;
}

template <class Value>
bool same(const LoggedDefinition<Value>& a, const LoggedDefinition<Value>& b) {
  return a.id == b.id && a.name == b.name && a.value == b.value;
}

/// Fills in the omitted words from the row before.
const char* complete_write(store::Write& write, const EntityState& before) {
  if (write.base_version_low != static_cast<std::uint16_t>(before.written_by))
    return "it omits words of another version than that of the row before";
  complete(write.state.row.motion, before.row.motion, write.unchanged);
  write.unchanged = 0;
  return check_stored(write.state.row.motion);
}

}  // namespace

void World::restore(store::Store& store) const {
  for (const WorldGeometry& geometry : geometries) {
    const GeometryOptions& options = geometry.logged.options;
    if (options.deforms)
      store.keep_shapes(
          geometry.logged.id,
          store::ShapeHistory::make(shape_of(geometry), options.retained_shapes, geometry.shape_version));
  }
  store.restore(restored());
}

const char* World::apply(store::WriteSet& set) {
  if (set.version <= latest.version) return "its version is not after the one before it";
  if (set.time < latest.time) return "its world time is before that of the version before it";
  before_.clear();
  shapes_before_.clear();
  const char* fault = nullptr;
  for (store::Write& write : set.writes)
    if (fault == nullptr) fault = apply(write);
  for (const store::ShapeWrite& write : set.shapes)
    if (fault == nullptr) fault = apply(write, set.version);
  can_discard_ = fault == nullptr;
  if (fault != nullptr) {
    undo();
    return fault;
  }
  latest_before_ = std::exchange(latest, {set.version, set.time});
  next_version = std::max(next_version, set.version + 1);
  return nullptr;
}

const char* World::apply(store::Write& write) {
  const EntityId id = write.state.id;
  const bool creates = write.kind == store::WriteKind::create;
  const bool known = id.index < rows.size();
  if (creates && !known) {
    rows.resize(id.index + 1);
    generations.resize(id.index + 1, 0);
  }
  if (creates) {
    if (rows[id.index].id.valid()) return "it creates an entity where one lives";
    if (id.generation != generations[id.index] + 1)
      return "it creates an entity with a generation that is not the next";
  } else if (!known || rows[id.index].id != id) {
    return "it writes to an entity that is not there";
  }
  EntityState& state = rows[id.index];
  const bool whole = creates || write.kind == store::WriteKind::update;
  const GeometryId geometry = write.state.row.geometry;
  if (whole && geometry.valid() && !knows(geometry)) return "it refers to an unknown geometry";
  if (whole && !knows(write.state.row.material)) return "it refers to an unknown material";
  const LightId light = write.state.row.light;
  if (whole && light.valid() && !knows(light)) return "it refers to an unknown light";
  if (write.unchanged != 0) {
    if (const char* fault = complete_write(write, state)) return fault;
  }

  before_.push_back({id.index, generations[id.index], state});
  generations[id.index] = id.generation;
  if (write.kind == store::WriteKind::remove) {
    state = {};
    return nullptr;
  }
  if (whole) {
    state = write.state;
  } else {
    state.row.motion = write.state.row.motion;
    state.written_by = write.state.written_by;
    write.state.row = state.row;
  }
  return nullptr;
}

const char* World::apply(const store::ShapeWrite& write, Version version) {
  if (!knows(write.geometry)) return "it changes the shape of an unknown geometry";
  WorldGeometry& geometry = geometries[write.geometry.index];
  if (!geometry.logged.options.deforms) return "it changes the shape of a geometry that does not deform";
  if (write.positions_m.size() != geometry.mesh.positions_m.size())
    return "its shape has another number of positions than the geometry";
  shapes_before_.push_back({write.geometry.index, geometry.shape_version, std::move(geometry.positions_m)});
  geometry.shape_version = version;
  geometry.positions_m.assign(write.positions_m.begin(), write.positions_m.end());
  return nullptr;
}

void World::undo() {
  for (auto before = before_.rbegin(); before != before_.rend(); ++before) {
    rows[before->index] = before->state;
    generations[before->index] = before->generation;
  }
  for (auto before = shapes_before_.rbegin(); before != shapes_before_.rend(); ++before) {
    WorldGeometry& geometry = geometries[before->geometry];
    geometry.shape_version = before->version;
    geometry.positions_m = std::move(before->positions_m);
  }
  before_.clear();
  shapes_before_.clear();
  can_discard_ = false;
}

const char* World::discard(Version version) {
  if (!can_discard_ || version != latest.version) return "it discards a version that is not the last one";
  undo();
  latest = latest_before_;
  return nullptr;
}

const char* World::add(const LoggedGeometry& geometry, StoredMesh&& mesh) {
  if (knows(geometry.id))
    return same(geometries[geometry.id.index].logged, geometry)
               ? nullptr
               : "it adds a geometry with an index that is in use";
  if (geometry.id.index != geometries.size()) return "it adds a geometry whose index is not the next";
  geometries.push_back({geometry, std::move(mesh), 0, {}});
  return nullptr;
}

const char* World::add(const LoggedMaterial& material) {
  if (knows(material.id)) {
    return same(materials[material.id.index - 1], material)
               ? nullptr
               : "it adds a material with an index that is in use";
  }
  if (material.id.index != materials.size() + 1) return "it adds a material whose index is not the next";
  materials.push_back(material);
  return nullptr;
}

const char* World::add(const LoggedLight& light) {
  if (knows(light.id))
    return same(lights[light.id.index], light) ? nullptr : "it adds a light with an index that is in use";
  if (light.id.index != lights.size()) return "it adds a light whose index is not the next";
  lights.push_back(light);
  return nullptr;
}

}  // namespace rtstdb::log
