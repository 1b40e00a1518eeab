#pragma once
// Cones, compared with closest-hit rays along the same axes.

#include <vector>

#include "bench/figure/suite.hpp"

namespace hil::bench {

/// `cone_fast_vs_ray`, `cone_exact_vs_ray`: first contacts of beams of 0.02 degrees from a camera that looks
/// at a body in a bowl. `cone_fractions_vs_exact`, `cone_fast_fractions_vs_exact`: fewer beams, with
/// fractions.
/// `..._scattered`: beams from random places in random directions.
std::vector<Figure> measure_cones(const SuiteOptions& options);

}  // namespace hil::bench
