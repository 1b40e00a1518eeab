#pragma once
// Builds of distance fields beside nearest queries, from which a field could be built as well.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

/// For each mesh `field_build_<mesh>`: distances a second of a whole build, against those of a nearest query
/// at points near the surface; and `..._seconds`, `..._bytes`, `..._error_p99` (parts per million of the
/// diagonal; 2000 are wanted).
std::vector<Figure> measure_field_builds(const SuiteOptions& options);

}  // namespace hil::bench
