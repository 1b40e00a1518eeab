#pragma once
// Bytes of log per second that the writer brings to disk: records from the ring, group, checksum, write and
// sync, over several segments. Compared with a loop that only writes the same bytes in the same pieces.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_log_bandwidth(const SuiteOptions& options);

}  // namespace hil::bench
