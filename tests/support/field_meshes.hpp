#pragma once
// Meshes of which fields are built in tests, and a build whose distances the oracle computes.

#include <rtstdb/geometry.hpp>

#include "rtstdb/field/field_build.hpp"
#include "rtstdb/oracle/mesh_distance.hpp"
#include "tests/support/concave_meshes.hpp"

namespace rtstdb::test {

/// A square plate with a square hole, closed.
TriangleMesh make_plate_with_hole(double size_m, double hole_m, double thickness_m);
/// A trunk with wings a few millimetres thick: most of its parts are far thinner than any cell.
TriangleMesh make_small_station();

/// Builds a field as the database does. `part`: points in each part.
Result<field::StoredField> build_with_oracle(const TriangleMesh& mesh, const oracle::MeshDistance& distance,
                                             const FieldOptions& options, std::size_t part = 1000);

}  // namespace rtstdb::test
