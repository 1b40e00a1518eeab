#pragma once
// A region brought to the instant it asks at. Internal to the oracle.

#include "rtstdb/oracle/frustum.hpp"
#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {

/// A region where it stands in the world at its instant; half_extent_m is the region's own.
struct PosedRegion {
  OrientedBox box;
  double noise_units = 0.0;
};

PosedRegion posed_region(const World& world, const Region& region);

/// `at`: where the region stands.
Frustum frustum_of(const Region& region, const OrientedBox& at);

}  // namespace rtstdb::oracle
