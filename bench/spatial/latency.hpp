#pragma once
// The latency of one small query from submit to results.

#include <vector>

#include "bench/figure/figure.hpp"
#include "bench/spatial/side_by_side.hpp"

namespace hil::bench {

/// 64 rays in a world of 1,000 entities, one transaction after the other, without a peer.
/// latency_small_query_p50 and _p99: the version is that of the previous query;
/// latency_small_update_query_p50 and _p99: the transaction first moves one entity, so the structure is
/// brought to a new version.
std::vector<Figure> measure_latency(const SuiteOptions& options);

}  // namespace hil::bench
