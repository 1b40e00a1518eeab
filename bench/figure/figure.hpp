#pragma once
// One measured figure with that of its peer, printed as one line. Every suite prints its results this way.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace hil::bench {

enum class Better : std::uint8_t { lower, higher };

struct Figure {
  std::string name;
  double ours = 0.0;
  std::string unit;
  std::string peer;              ///< name and version; empty: none
  std::optional<double> theirs;  ///< in the same unit
  Better better = Better::lower;
  std::uint64_t samples = 0;  ///< behind `ours`

  /// Above 1: better than the peer. Absent without a peer, and instead of a division by zero.
  std::optional<double> ratio() const;
};

/// The CPU model and the number of CPUs.
std::string device_name();

/// One JSON object with name, ours, unit, peer, theirs, ratio, better, device and samples; absent values are
/// null.
std::string as_json_line(const Figure& figure, const std::string& device);
/// The same as text for people.
std::string as_text_line(const Figure& figure);

/// The median; of an even number of values the mean of the two middle ones. Misuse (asserts): no values.
double median(std::vector<double> values);
/// The value at quantile `share` (0 to 1), one of the given values. Misuse (asserts): no values.
double quantile(std::vector<double> values, double share);

}  // namespace hil::bench
