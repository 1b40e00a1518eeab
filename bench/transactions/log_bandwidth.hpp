#pragma once
// Bytes of log that the writer brings to the disk in a second: records out of the ring, group, checksum, write, sync, segment after
// segment. Beside it the same number of bytes in the same pieces, written by a loop that does nothing else.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

std::vector<Figure> measure_log_bandwidth(const SuiteOptions& options);

}  // namespace hil::bench
