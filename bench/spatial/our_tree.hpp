#pragma once
// The structure of one geometry as it lies on the device.

#include <rtstdb/geometry.hpp>

namespace hil::bench {

/// By tree_cost.hpp, with the boxes that rays meet: those in quanta.
double our_tree_cost(const rtstdb::TriangleMesh& mesh);

}  // namespace hil::bench
