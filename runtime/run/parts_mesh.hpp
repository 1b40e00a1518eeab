#pragma once
// The mesh of a shape that is made of parts.

#include <span>

#include <rtstdb/geometry.hpp>

#include "runtime/config/parts_file.hpp"

namespace hil::run {

/// All triangles of all parts, in their order. Each part is closed, with its fronts outside; parts may
/// overlap. Allocates.
rtstdb::TriangleMesh mesh_of_parts(std::span<const config::Part> parts);

}  // namespace hil::run
