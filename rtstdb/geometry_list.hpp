#pragma once
// The geometries of a database with their meshes, as they were added, and their distance fields.
//
// Threads: any, but the engine's. Adding a geometry and building a field exclude each other.

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <rtstdb/database.hpp>

#include "rtstdb/geometry/convex_parts.hpp"
#include "rtstdb/log/world.hpp"
#include "rtstdb/query/gpu_executor.hpp"
#include "rtstdb/standing/follower.hpp"
#include "rtstdb/transaction/engine.hpp"

namespace rtstdb {

struct ListedGeometry {
  std::shared_ptr<const TriangleMesh> mesh;  ///< as it was added
  std::string name;
  Bounds bounds{};  ///< of the mesh and of its parts
  bool deforms = false;
  bool is_closed = false;
  bool is_solid = false;               ///< it has GeometryOptions::solid
  std::optional<FieldReport> field{};  ///< of the field that was built
  std::optional<FieldOptions> field_on_first_use{};
  std::shared_ptr<const ConvexParts> parts{};  ///< null: it has none, or it deforms
};

/// Database::geometry_info.
GeometryInfo info_of(const ListedGeometry& geometry);

/// Adds the geometries of a log to the device, in the order of their ids.
Result<std::vector<ListedGeometry>> add_recovered_geometries(const log::World& world,
                                                             query::GpuExecutor& executor);

class GeometryList {
 public:
  /// What geometries are added to, and the device time of a part of a build (FieldJob::part).
  struct Parts {
    transaction::Engine& engine;
    query::GpuExecutor& executor;
    standing::Follower& follower;
    Nanoseconds chunk;
  };

  /// The recovered geometries are on the device.
  GeometryList(const Parts& parts, std::vector<ListedGeometry> recovered);

  /// Database::add_geometry, of a database that may be written, with a valid mesh and valid options. The
  /// error does not name the geometry.
  Result<GeometryId> add(const TriangleMesh& mesh, std::string_view name, const GeometryOptions& options);
  /// Database::build_field, with options in their range. The error names the geometry.
  Result<FieldReport> build_field(GeometryId id, const FieldOptions& options);
  /// Builds the fields with FieldOptions::on_first_use that do not exist yet.
  Result<void> build_fields_on_first_use();

  std::optional<GeometryId> find(std::string_view name) const;
  /// Empty: no such geometry.
  std::optional<ListedGeometry> find(GeometryId id) const;

 private:
  Result<GeometryId> add_with_field(ListedGeometry& geometry, const GeometryOptions& options);
  void remove_last_geometry();
  /// The lock on adding is held.
  Result<FieldReport> build(GeometryId id, const ListedGeometry& geometry, const FieldOptions& options);

  const Parts parts_;
  std::mutex adding_mutex_;  // so that geometries are in the order of their ids, with one field each
  mutable std::mutex mutex_;
  std::vector<ListedGeometry> geometries_;  // by index
};

/// The error with the geometry's name.
Error with_geometry_name(std::string_view name, const Error& error);

}  // namespace rtstdb
