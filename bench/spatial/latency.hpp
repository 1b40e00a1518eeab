#pragma once
// How long one small query takes from submit to answer.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// 64 rays at 1,000 entities, one transaction after the other, nobody to compare with:
/// latency_small_query_p50 and _p99: the version is the one asked before; latency_small_update_query_p50 and
/// _p99: the transaction moves one entity first, so that the structure is brought to a new version.
std::vector<Figure> measure_latency(const SuiteOptions& options);

}  // namespace hil::bench
