#pragma once
// Moving bodies and box searches, compared with SQLite and its R*Tree.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_sqlite(const SuiteOptions& options);

}  // namespace hil::bench
