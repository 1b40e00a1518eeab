#pragma once
// Bodies move and boxes are searched, beside SQLite with its R*Tree.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_sqlite(const SuiteOptions& options);

}  // namespace hil::bench
