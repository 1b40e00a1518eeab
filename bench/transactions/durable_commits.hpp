#pragma once
// Latency from submit until a commit of one row is on disk, one after the other, in group and in sync mode,
// compared with a loop that only writes and syncs as many bytes.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_durable_commits(const SuiteOptions& options);

}  // namespace hil::bench
