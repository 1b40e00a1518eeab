#pragma once
// The bodies that a scenario lists under world.entities: their geometry, their entities, and their outlines
// for the report.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/modules/named_world.hpp"
#include "runtime/report/run_record.hpp"
#include "runtime/run/world_fields.hpp"

namespace hil::run {

/// The different shapes of the entities.
struct Scenery {
  std::vector<rtstdb::TriangleMesh> meshes;
  std::vector<rtstdb::GeometryOptions> options;          ///< by mesh: its convex parts and its solid
  std::vector<rtstdb::Bounds> bounds;                    ///< by mesh
  std::vector<const config::WorldEntity*> first_entity;  ///< by mesh: the first entity of that shape
  std::vector<std::optional<std::size_t>> mesh_of;       ///< by entity; none: it has no shape
};

/// Makes the shapes and reads the mesh files. Adds a mistake for a file that can not be read or used, for
/// convex parts or a solid that do not fit their mesh, and for an entity whose scale is beyond the database's
/// limits; the scenery is then not usable. Warns of the materials and textures of a mesh file, which are
/// ignored.
Scenery make_scenery(const config::World& world, config::Diagnostics& diagnostics);

/// Creates the materials, the lights and the entities, and their geometries from the meshes, which `scenery`
/// then no longer has. The fields are built when a query first needs them. Throws modules::SetupError.
void create_scenery(const config::Scenario& scenario, Scenery& scenery, modules::NamedWorld& world,
                    WorldFields& fields);

/// Motions of the scenery as the scenario gives them, by entity: from the first tick on.
std::vector<rtstdb::Motion> first_motions(const config::World& world);

/// Outlines of the bodies from above at an instant of run time, with these motions by entity. The outline of
/// a mesh is that of its rotated box.
std::vector<report::Shape> outlines(const config::Scenario& scenario, const Scenery& scenery,
                                    std::span<const rtstdb::Motion> motions, std::int64_t time_ns);

}  // namespace hil::run
