#pragma once

#include "runtime/report/run_record.hpp"

namespace hil::report::test {

/// A record of an imaginary run, with something in every part: misses, degradation, a failed expectation,
/// buses, the crossing from above, three scans.
RunRecord full_record();

}  // namespace hil::report::test
