#pragma once
// Builds of distance fields, compared with nearest queries, which compute the same distances.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

/// For each mesh `field_build_<mesh>`: distances per second of a whole build, compared with those of a
/// nearest query at points near the surface; and `..._seconds`, `..._bytes`, `..._error_p99` (parts per
/// million of the diagonal; wanted: 2000).
std::vector<Figure> measure_field_builds(const SuiteOptions& options);

}  // namespace hil::bench
