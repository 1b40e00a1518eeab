#pragma once
// From submit until a commit of one row is on disk, one after the other, in group and in sync mode. Beside it as many bytes written and
// synced by a loop that does nothing else.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_durable_commits(const SuiteOptions& options);

}  // namespace hil::bench
