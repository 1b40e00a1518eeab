#pragma once
// The lanes above the signals of a plot: each shows the times at which a stimulus or a fault was active. The
// stimuli and faults of one test table share a lane.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "runtime/report/run_record.hpp"

namespace hil::report {

/// The most lanes of a plot, faults first. Lanes::left_out counts the stimuli and faults of the others.
inline constexpr std::size_t max_lanes = 12;

/// Whether a part of the time from `begin_ns` to `end_ns` is in the plot.
inline bool is_in_plot(const SignalPlot& plot, std::int64_t begin_ns, std::int64_t end_ns) {
  return begin_ns <= plot.end_ns && end_ns >= plot.begin_ns;
}

struct LaneSpan {
  ActiveSpan span;
  bool is_fault = false;
};

struct Lane {
  std::string kind;  ///< "fault", "stimulus", "test table"
  std::string name;
  std::vector<LaneSpan> spans;  ///< stimuli first
  std::string name_suffix;      ///< ", the first 100": which of its times there are; empty: all
  std::size_t injections = 0;   ///< stimuli and faults
};

struct Lanes {
  std::vector<Lane> shown;
  std::size_t left_out = 0;
};

/// Of what was active within the plot.
Lanes lanes_of(const RunRecord& record, const SignalPlot& plot);

}  // namespace hil::report
