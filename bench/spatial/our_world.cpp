#include "bench/spatial/our_world.hpp"

#include <algorithm>

#include "bench/spatial/side_by_side.hpp"
#include "rtstdb/open_database.hpp"

namespace hil::bench {

OurWorld::OurWorld(const rtstdb::DatabaseOptions& options, rtstdb::Nanoseconds spin)
    : database_(must(rtstdb::open_database(options, {}, spin))) {}

OurWorld::OurWorld(std::uint32_t max_entities, std::uint32_t max_geometries, rtstdb::Nanoseconds spin,
                   const rtstdb::DurabilityOptions& durability)
    : OurWorld({.max_entities = max_entities,
                .max_geometries = max_geometries,
                .retained_changes = 2 * max_entities,
                .chunk = rtstdb::Nanoseconds(0),
                .durability = durability},
               spin) {}

rtstdb::GeometryId OurWorld::add(const rtstdb::TriangleMesh& mesh) {
  return must(database_->add_geometry(mesh, "mesh"));
}

std::vector<rtstdb::EntityId> OurWorld::create(std::span<const rtstdb::EntityRow> rows) {
  const auto count = static_cast<std::uint32_t>(rows.size());
  const auto transaction = database_->make_transaction({.max_writes = count});
  transaction->begin({});
  for (const rtstdb::EntityRow& row : rows)
    transaction->create(row);
  const rtstdb::Outcome& outcome = database_->execute(*transaction);
  if (!outcome.done()) throw std::runtime_error(rtstdb::describe(outcome));
  std::vector<rtstdb::EntityId> made;
  made.reserve(count);
  for (std::uint32_t i = 0; i < count; ++i)
    made.push_back(transaction->created(i));
  return made;
}

PreparedBatch<rtstdb::RayQuery> prepare_rays(OurWorld& world, std::span<const rtstdb::Ray> rays,
                                             rtstdb::RayMode mode) {
  const auto count = static_cast<std::uint32_t>(rays.size());
  auto query = must(
      world.database().prepare(rtstdb::RayQueryOptions{.name = "bench", .capacity = count, .mode = mode}));
  std::copy(rays.begin(), rays.end(), query->rays().begin());
  return {world.database(), std::move(query), count};
}

std::string spatial_device() {
  const rtstdb::DeviceInfo device = must(rtstdb::Database::open({}))->device();
  return device.name + ", " + device.driver;
}

}  // namespace hil::bench
