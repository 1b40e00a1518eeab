#include "rtstdb/geometry_list.hpp"

#include <utility>

#include "rtstdb/catch_out_of_memory.hpp"
#include "rtstdb/field_job.hpp"
#include "rtstdb/geometry/closed_mesh.hpp"
#include "rtstdb/geometry/given_parts.hpp"
#include "rtstdb/geometry/solid_hull.hpp"
#include "rtstdb/log_space.hpp"
#include "rtstdb/option_check.hpp"
#include "rtstdb/store/shape_history.hpp"

namespace rtstdb {

namespace {

/// Null: the geometry does not consist of convex parts, or it deforms. Errors: solid_hull,
/// given_convex_parts.
Result<std::shared_ptr<const ConvexParts>> parts_of(const TriangleMesh& mesh, bool deforms,
                                                    const ConvexPartPoints& given_m,
                                                    const std::optional<Solid>& solid) {
  if (deforms) return std::shared_ptr<const ConvexParts>();
  if (solid) {
    auto hull = solid_hull(mesh, *solid);
    if (!hull) return hull.error();
    return std::make_shared<const ConvexParts>(1, std::move(hull).value());
  }
  if (!given_m.empty()) {
    auto parts = given_convex_parts(mesh, given_m);
    if (!parts) return parts.error();
    return std::make_shared<const ConvexParts>(std::move(parts).value());
  }
  ConvexParts parts = convex_parts_of(mesh);
  return parts.empty() ? nullptr : std::make_shared<const ConvexParts>(std::move(parts));
}

/// Parts of a geometry that a log holds, without checks.
std::shared_ptr<const ConvexParts> recovered_parts_of(const TriangleMesh& mesh, bool deforms,
                                                      const ConvexPartPoints& given_m,
                                                      const std::optional<Solid>& solid) {
  if (deforms) return nullptr;
  if (solid) return std::make_shared<const ConvexParts>(1, recovered_solid_hull(mesh, *solid));
  ConvexParts parts = given_m.empty() ? convex_parts_of(mesh) : recovered_convex_parts(mesh, given_m);
  return parts.empty() ? nullptr : std::make_shared<const ConvexParts>(std::move(parts));
}

/// The mesh as the database holds it: deforming geometry has no corner normals.
std::shared_ptr<const TriangleMesh> held_mesh(const TriangleMesh& mesh, bool deforms) {
  if (!deforms || mesh.corner_normals.empty()) return std::make_shared<const TriangleMesh>(mesh);
  return std::make_shared<const TriangleMesh>(TriangleMesh{
      .positions_m = mesh.positions_m, .triangles = mesh.triangles, .corner_colors = mesh.corner_colors});
}

}  // namespace

Error with_geometry_name(std::string_view name, const Error& error) {
  return {error.code, "geometry '" + std::string(name) + "': " + error.message};
}

GeometryInfo info_of(const ListedGeometry& geometry) {
  GeometryInfo info{.name = geometry.name,
                    .triangles = static_cast<std::uint32_t>(geometry.mesh->triangles.size()),
                    .deforms = geometry.deforms,
                    .closed = geometry.is_closed,
                    .convex = geometry.parts && geometry.parts->size() == 1,
                    .solid = geometry.is_solid};
  if (!geometry.parts) return info;
  info.convex_parts = static_cast<std::uint32_t>(geometry.parts->size());
  for (const ConvexHull& hull : *geometry.parts) {
    info.hull_corners += static_cast<std::uint32_t>(hull.corners_m.size());
    info.hull_faces += static_cast<std::uint32_t>(hull.faces.size());
  }
  return info;
}

Result<std::vector<ListedGeometry>> add_recovered_geometries(const log::World& world,
                                                             query::GpuExecutor& executor) {
  std::vector<ListedGeometry> recovered;
  for (const log::WorldGeometry& geometry : world.geometries) {
    const auto& [id, name, options, file, checksum] = geometry.logged;
    const auto mesh = std::make_shared<const TriangleMesh>(geometry.mesh);
    const auto parts =
        recovered_parts_of(*mesh, options.deforms, geometry.mesh.convex_parts_m, geometry.mesh.solid);
    auto added = executor.add_geometry(mesh, options, parts);
    if (!added)
      return Error{added.error().code, "geometry '" + name + "' of the log: " + added.error().message};
    RTSTDB_ASSERT(added.value() == id, "the geometry got another id than in the log");
    recovered.push_back({.mesh = mesh,
                         .name = name,
                         .bounds = executor.last_bounds(),
                         .deforms = options.deforms,
                         .is_closed = is_closed(*mesh),
                         .is_solid = geometry.mesh.solid.has_value(),
                         .parts = parts});
  }
  return recovered;
}

GeometryList::GeometryList(const Parts& parts, std::vector<ListedGeometry> recovered)
    : parts_(parts), geometries_(std::move(recovered)) {
  for (std::uint32_t index = 0; index < geometries_.size(); ++index) {
    const ListedGeometry& geometry = geometries_[index];
    parts_.follower.make_space_for_geometry();
    parts_.follower.add_geometry(geometry.bounds, geometry.deforms);
    if (geometry.deforms)
      parts_.engine.call([&, used = standing::Follower::used_positions(*geometry.mesh)]() mutable {
        parts_.follower.keep_bounds(GeometryId{index}, std::move(used));
      });
  }
}

Result<GeometryId> GeometryList::add(const TriangleMesh& mesh, std::string_view name,
                                     const GeometryOptions& options) {
  const std::lock_guard lock(adding_mutex_);
  auto parts = parts_of(mesh, options.deforms, options.convex_parts_m, options.solid);
  if (!parts) return parts.error();
  ListedGeometry listed{.mesh = held_mesh(mesh, options.deforms),
                        .name = std::string(name),
                        .deforms = options.deforms,
                        .is_closed = is_closed(mesh),
                        .is_solid = options.solid.has_value(),
                        .parts = std::move(parts).value()};
  {
    const std::lock_guard reading_lock(mutex_);
    geometries_.reserve(geometries_.size() + 1);
  }
  parts_.follower.make_space_for_geometry();
  std::unique_ptr<store::ShapeHistory::Ring> shapes;
  if (options.deforms) shapes = store::ShapeHistory::make(mesh.positions_m, options.retained_shapes);
  std::optional<log::LoggedGeometry> logged;
  if (transaction::CommitLog* log = parts_.engine.log()) {
    auto written = log->write_geometry(*listed.mesh, name, options);
    if (!written) return written.error();
    logged = std::move(written).value();
  }
  auto used_positions =
      options.deforms ? standing::Follower::used_positions(mesh) : std::vector<std::uint32_t>();
  std::optional<GeometryId> with_field;  // on the device with its field, but not in the database yet
  if (options.field && options.field->on_first_use) {
    listed.field_on_first_use = options.field;
  } else if (options.field) {
    auto built = add_with_field(listed, options);
    if (!built) return built.error();
    with_field = built.value();
  }
  std::optional<Result<GeometryId>> added;
  const auto add_on_engine = [&] {
    if (logged && !parts_.engine.log()->has_space_for(*logged)) return;
    if (with_field) {
      parts_.executor.withhold_last_geometry(false);
      added.emplace(*with_field);
    } else {
      added.emplace(catch_out_of_memory<GeometryId>(
          "it", {}, [&] { return parts_.executor.add_geometry(listed.mesh, options, listed.parts); }));
    }
    if (!*added) return;
    // Before any version that uses the geometry can be read.
    parts_.follower.add_geometry(parts_.executor.last_bounds(), options.deforms);
    if (shapes != nullptr) {
      parts_.engine.keep_shapes(added->value(), std::move(shapes));
      parts_.follower.keep_bounds(added->value(), std::move(used_positions));
    }
    if (logged) logged->id = added->value();
    if (logged) parts_.engine.log()->record_geometry(*logged, mesh.positions_m.size());
  };
  if (auto called = call_until(parts_.engine, add_on_engine, [&] { return added.has_value(); }); !called) {
    if (with_field) remove_last_geometry();
    return called.error();
  }
  if (!*added) return added->error();
  const std::lock_guard reading_lock(mutex_);
  geometries_.push_back(std::move(listed));
  return *added;
}

/// Adds a geometry and its field to the device; neither, if one of them fails.
Result<GeometryId> GeometryList::add_with_field(ListedGeometry& geometry, const GeometryOptions& options) {
  std::optional<Result<GeometryId>> added;
  parts_.engine.call([&] {
    added.emplace(catch_out_of_memory<GeometryId>(
        "it", {}, [&] { return parts_.executor.add_geometry(geometry.mesh, options, geometry.parts); }));
    parts_.executor.withhold_last_geometry(added->ok());
  });
  if (!*added) return added->error();
  auto built = build(added->value(), geometry, *options.field);
  if (built) {
    geometry.field = built.value();
    return *added;
  }
  remove_last_geometry();
  return built.error();
}

/// An error is ignored: the device is lost then, and the geometry with it.
void GeometryList::remove_last_geometry() {
  parts_.engine.call([this] {
    static_cast<void>(
        catch_out_of_memory<void>("", {}, [this] { return parts_.executor.remove_last_geometry(); }));
  });
}

Result<FieldReport> GeometryList::build_field(GeometryId id, const FieldOptions& options) {
  const std::lock_guard lock(adding_mutex_);
  const auto geometry = find(id);
  if (!geometry)
    return Error{ErrorCode::bad_input, "geometry " + std::to_string(id.index) + " does not exist"};
  if (auto valid = check_options(GeometryOptions{.deforms = geometry->deforms, .field = options}); !valid)
    return with_geometry_name(geometry->name, valid.error());
  if (geometry->field)
    return with_geometry_name(geometry->name, {ErrorCode::bad_input, "it has a distance field already"});
  auto built = build(id, *geometry, options);
  if (!built) return with_geometry_name(geometry->name, built.error());
  const std::lock_guard reading_lock(mutex_);
  geometries_[id.index].field = built.value();
  return built;
}

Result<void> GeometryList::build_fields_on_first_use() {
  const std::lock_guard lock(adding_mutex_);
  for (GeometryId id{0};; ++id.index) {
    const auto geometry = find(id);
    if (!geometry) return {};
    if (geometry->field || !geometry->field_on_first_use) continue;
    auto built = build(id, *geometry, *geometry->field_on_first_use);
    if (!built) return with_geometry_name(geometry->name, built.error());
    const std::lock_guard reading_lock(mutex_);
    geometries_[id.index].field = built.value();
  }
}

Result<FieldReport> GeometryList::build(GeometryId id, const ListedGeometry& geometry,
                                        const FieldOptions& options) {
  return catch_out_of_memory<FieldReport>("its distance field", {}, [&] {
    return FieldJob{parts_.engine, parts_.executor, parts_.chunk}.run(id, *geometry.mesh, options);
  });
}

std::optional<GeometryId> GeometryList::find(std::string_view name) const {
  const std::lock_guard lock(mutex_);
  for (std::size_t index = geometries_.size(); index-- > 0;)
    if (geometries_[index].name == name) return GeometryId{static_cast<std::uint32_t>(index)};
  return std::nullopt;
}

std::optional<ListedGeometry> GeometryList::find(GeometryId id) const {
  const std::lock_guard lock(mutex_);
  return id.index < geometries_.size() ? std::optional(geometries_[id.index]) : std::nullopt;
}

}  // namespace rtstdb
