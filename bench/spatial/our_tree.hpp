#pragma once
// The structure of one geometry as stored on the device.

#include <rtstdb/geometry.hpp>

namespace hil::bench {

/// By tree_cost.hpp, with the quantized boxes that rays test.
double our_tree_cost(const rtstdb::TriangleMesh& mesh);

}  // namespace hil::bench
