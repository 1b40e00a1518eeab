#include "rtstdb/standing/mirror.hpp"

#include <algorithm>
#include <iterator>
#include <utility>

#include <rtstdb/result.hpp>

namespace rtstdb::standing {
namespace {

void sort_unique(std::vector<std::uint32_t>& indices) {
  std::ranges::sort(indices);
  indices.erase(std::unique(indices.begin(), indices.end()), indices.end());
}

bool same(const Bounds& a, const Bounds& b) {
  return a.minimum_m == b.minimum_m && a.maximum_m == b.maximum_m;
}

}  // namespace

void Mirror::make_space_for_geometry() {
  const std::lock_guard lock(added_mutex_);
  added_.reserve(added_.size() + 1);
}

void Mirror::add_geometry(const Bounds& bounds, bool deforms) {
  const std::lock_guard lock(added_mutex_);
  added_.push_back({bounds, deforms, {}});
}

void Mirror::take_added_geometries() {
  const std::lock_guard lock(added_mutex_);
  geometries_.reserve(geometries_.size() + added_.size());
  std::ranges::move(added_, std::back_inserter(geometries_));
  added_.clear();
}

EntityBox Mirror::box(const EntityState& state, bool is_point) const noexcept {
  const Bounds& bounds = geometries_[state.row.geometry.index].bounds;
  const glm::dvec3 minimum_m(bounds.minimum_m);
  const glm::dvec3 maximum_m(bounds.maximum_m);
  EntityBox box;
  box.center_m = state.row.scale * 0.5 * (minimum_m + maximum_m);
  if (!is_point) box.half_extent_m = state.row.scale * 0.5 * (maximum_m - minimum_m);
  box.is_point = is_point;
  return box;
}

void Mirror::set_row(const EntityState& state) {
  const GeometryId geometry = state.row.geometry;
  if (geometry.valid() && geometry.index >= geometries_.size()) take_added_geometries();
  RTSTDB_ASSERT(!geometry.valid() || geometry.index < geometries_.size(), "a row has an unknown geometry");
  if (state.id.index >= rows_.size()) rows_.resize(state.id.index + 1);
  EntityState& row = rows_[state.id.index];
  const bool used_before = row.id.valid() && row.row.geometry == geometry;
  row = state;
  if (!geometry.valid() || !geometries_[geometry.index].deforms || used_before) return;
  std::vector<std::uint32_t>& users = geometries_[geometry.index].users;
  if (users.size() > 2 * rows_.size()) {
    sort_unique(users);
    std::erase_if(users, [&](std::uint32_t index) { return rows_[index].row.geometry != geometry; });
  }
  users.push_back(state.id.index);
}

void Mirror::append_users(const Geometry& geometry, std::uint32_t id,
                          std::vector<std::uint32_t>& changed) const {
  for (const std::uint32_t index : geometry.users)
    if (const EntityState* state = row(index); state != nullptr && state->row.geometry.index == id)
      changed.push_back(index);
}

void Mirror::apply(std::span<const Change> changes, std::vector<std::uint32_t>& changed) {
  changed.clear();
  for (const Change& change : changes) {
    switch (change.kind) {
      case Change::Kind::row:
        set_row(change.state);
        changed.push_back(change.state.id.index);
        break;
      case Change::Kind::removed:
        if (change.state.id.index < rows_.size()) rows_[change.state.id.index] = {};
        changed.push_back(change.state.id.index);
        break;
      case Change::Kind::shape:
        if (change.geometry.index >= geometries_.size()) take_added_geometries();
        geometries_[change.geometry.index].bounds = change.bounds;
        break;
    }
    version_ = change.version;
  }
  // After all rows are applied, so that the users of a geometry are known.
  for (const Change& change : changes) {
    if (change.kind == Change::Kind::shape)
      append_users(geometries_[change.geometry.index], change.geometry.index, changed);
  }
  sort_unique(changed);
}

void Mirror::compare(std::span<const EntityState> rows, std::span<const ShapeBounds> shapes,
                     std::vector<std::uint32_t>& changed) {
  changed.clear();
  auto next = rows.begin();
  for (std::uint32_t index = 0; index < rows_.size() || next != rows.end(); ++index) {
    const EntityState* now = next != rows.end() && next->id.index == index ? &*next++ : nullptr;
    const EntityState* before = row(index);
    const bool differs = (now == nullptr) != (before == nullptr) ||
                         (now != nullptr && (now->id != before->id || now->written_by != before->written_by));
    if (differs) changed.push_back(index);
  }
  take_added_geometries();
  for (const ShapeBounds& shape : shapes) {
    RTSTDB_ASSERT(shape.geometry.index < geometries_.size(), "a shape has an unknown geometry");
    const Geometry& geometry = geometries_[shape.geometry.index];
    if (!same(geometry.bounds, shape.bounds)) append_users(geometry, shape.geometry.index, changed);
  }
  sort_unique(changed);
}

void Mirror::replace(VersionInfo version, std::span<const EntityState> rows,
                     std::span<const ShapeBounds> shapes) {
  version_ = version;
  take_added_geometries();
  for (Geometry& geometry : geometries_)
    geometry.users.clear();
  std::ranges::fill(rows_, EntityState{});
  for (const EntityState& state : rows)
    set_row(state);
  for (const ShapeBounds& shape : shapes) {
    RTSTDB_ASSERT(shape.geometry.index < geometries_.size(), "a shape has an unknown geometry");
    geometries_[shape.geometry.index].bounds = shape.bounds;
  }
}

}  // namespace rtstdb::standing
