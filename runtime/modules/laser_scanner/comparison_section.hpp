#pragma once
// The report's section on a sweep comparison: one picture per case with the measured points, the measured
// length, the length by the closed form and the true length, and a table of these lengths.
//
// Threads: after the run.

#include <string>
#include <vector>

#include <hil/contribution.hpp>

#include "runtime/modules/laser_scanner/sweep_comparison.hpp"

namespace hil::modules {

/// The lengths of one body in one sweep.
struct ComparedLengths {
  std::string title;
  double true_m = 0.0;
  double measured_m = 0.0;
  double closed_form_m = 0.0;
  double tolerance_m = 0.0;  ///< by which measured and closed form may differ
};

contribution::Table lengths_table(const std::vector<ComparedLengths>& cases);

/// Adds the section, if a length was measured: the first such body without motion, then each with its motion.
/// Adds an event for each body whose length was not measured, with the reason.
void contribute_comparison(const SweepComparison& comparison, contribution::Contribution& report);

}  // namespace hil::modules
