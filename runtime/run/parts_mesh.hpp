#pragma once
// The mesh of a shape that is made of parts.

#include <span>

#include <rtstdb/geometry.hpp>

#include "runtime/config/parts_file.hpp"

namespace hil::run {

/// The triangles of all parts with their copies, in their order. Each copy is closed, with its fronts
/// outside; copies may overlap.
rtstdb::TriangleMesh mesh_of_parts(std::span<const config::Part> parts);

}  // namespace hil::run
