#pragma once
// A region at its time. Internal to the oracle.

#include "rtstdb/oracle/frustum.hpp"
#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {

/// A region's pose in the world at its time, with its half_extent_m.
struct PosedRegion {
  OrientedBox box;
  double noise_units = 0.0;
};

PosedRegion posed_region(const World& world, const Region& region);

/// `at`: the pose of the region.
Frustum frustum_of(const Region& region, const OrientedBox& at);

}  // namespace rtstdb::oracle
