#pragma once
// Whether two moving surfaces come nearer to each other than a distance, in double precision. Internal to the
// oracle and for tests. Pure functions.

#include <optional>

#include "rtstdb/oracle/oracle.hpp"

namespace rtstdb::oracle {

/// A time, up to `end_s` after the begin of the search, at which the surfaces of both entities are nearer
/// than `level_m`; any one. Empty: there is none that lasts for a nanosecond. By branch and bound over both
/// trees and time: the points of two nodes stay within spheres in an interval of time, so nodes whose spheres
/// are apart are left out for that interval. Misuse: an entity without geometry.
std::optional<double> time_nearer_than(const World& world, const ImpactSearch& search, EntityId second,
                                       double level_m, double end_s);

}  // namespace rtstdb::oracle
