#pragma once
// Fixture of tests of deforming geometry.

#include "tests/gpu/database_fixture.hpp"

namespace rtstdb::test {

using Positions = std::vector<glm::vec3>;

inline Positions scaled(const TriangleMesh& mesh, const glm::vec3& scale) {
  Positions positions = mesh.positions_m;
  for (glm::vec3& p : positions)
    p *= scale;
  return positions;
}

class DeformingGeometry : public DatabaseTest {
 protected:
  GeometryId add_deforming(const TriangleMesh& mesh, GeometryOptions options = {}) {
    options.deforms = true;
    const auto added = database().add_geometry(mesh, "deforming", options);
    EXPECT_TRUE(added.ok()) << (added ? "" : added.error().message);
    return added ? added.value() : GeometryId{};
  }
  std::unique_ptr<Transaction> make(std::uint32_t max_queries = 0) {
    return database().make_transaction(
        {.max_writes = 8, .max_queries = max_queries, .max_geometry_updates = 4, .max_positions = 100'000});
  }
  Outcome update(GeometryId geometry, std::span<const glm::vec3> positions_m, WorldTime time = {}) {
    const auto transaction = make();
    transaction->begin(terms_at(time));
    transaction->update_geometry(geometry, positions_m);
    return database().execute(*transaction);
  }
  Version committed(GeometryId geometry, std::span<const glm::vec3> positions_m, WorldTime time = {}) {
    const Outcome outcome = update(geometry, positions_m, time);
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    return outcome.version;
  }
  /// Towards the origin.
  static Ray along_x(WorldTime t = {}) { return ray_from({-10.0f, 0.01f, 0.02f}, {1, 0, 0}, t); }
  /// Of the ray along x; -1: a miss.
  float lambda(const ReadAt& read_at = {}) {
    const RayHit hit = trace(along_x(), read_at);
    return hit.status == HitStatus::hit ? hit.lambda : -1.0f;
  }
  Outcome outcome_of_a_ray(const ReadAt& read_at) {
    const auto query = prepare_rays();
    query->rays()[0] = along_x();
    return execute([&](Transaction& transaction) { transaction.add_query(*query, 1); }, {}, read_at);
  }
};

}  // namespace rtstdb::test
