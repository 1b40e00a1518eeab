#pragma once
// The bodies that a scenario lists under world.entities: geometry made or read, entities created, outlines
// for the report.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/config/scenario.hpp"
#include "runtime/modules/world.hpp"
#include "runtime/report/run_record.hpp"

namespace hil::run {

/// The shapes of the entities, each different one once.
struct Scenery {
  std::vector<rtstdb::TriangleMesh> meshes;
  std::vector<rtstdb::Bounds> bounds;          ///< by mesh
  std::vector<const config::WorldEntity*> of;  ///< by mesh: the first entity of that shape
  std::vector<std::size_t> mesh_of;            ///< by entity
};

/// Makes the shapes and reads the mesh files. A file that can not be read or used, and an entity that its scale
/// takes beyond the database's limits, is a mistake at its place; the scenery is then of no use.
Scenery make_scenery(const config::World& world, config::Diagnostics& diagnostics);

/// Puts the entities into the world, and their meshes with them: those of `scenery` are gone afterwards. Throws
/// modules::SetupError.
void create_scenery(const config::Scenario& scenario, Scenery& scenery, modules::World& world);

/// Outlines of the scenery from above, as it stands at an instant of run time. A mesh is seen as its turned box.
std::vector<report::Shape> outlines(const config::Scenario& scenario, const Scenery& scenery,
                                    std::int64_t time_ns);

}  // namespace hil::run
