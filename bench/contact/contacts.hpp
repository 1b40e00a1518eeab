#pragma once
// The families of the contact suite.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

/// Pairs of convex bodies (`narrow_convex_10k`), the right answers among them (`narrow_convex_right`), and
/// the latency of a small batch (`contact_16_pairs_p50`, `_p99`).
std::vector<Figure> measure_pairs(const SuiteOptions& options);

/// First times of impact of pairs that approach one another: of hulls (`time_of_impact_1k`) and of surfaces
/// (`time_of_impact_surfaces_1k`).
std::vector<Figure> measure_impacts(const SuiteOptions& options);

/// All pairs of moving bodies whose bounds overlap (`broad_10k`).
std::vector<Figure> measure_broad_phase(const SuiteOptions& options);

}  // namespace hil::bench
