#pragma once
// One measured figure beside its peer's, printed as one line. Every suite prints its results this way.

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
  std::string peer;              ///< name and version; empty: nobody to compare with
  std::optional<double> theirs;  ///< in the same unit
  Better better = Better::lower;
  std::uint64_t samples = 0;  ///< behind `ours`

  /// Above 1 is better than the peer. Absent without a peer, or when a division by zero would be needed.
  std::optional<double> ratio() const;
};

/// The machine in words: CPU model and how many.
std::string device_name();

/// One JSON object with name, ours, unit, peer, theirs, ratio, device, samples; what is absent is null.
std::string as_json_line(const Figure& figure, const std::string& device);
/// The same for people.
std::string as_text_line(const Figure& figure);

/// The middle value; the mean of the two middle ones of an even number. Misuse (asserts): no values.
double median(std::vector<double> values);
/// The value below which that share of them lies, 0 to 1; one of them. Misuse (asserts): no values.
double quantile(std::vector<double> values, double share);

}  // namespace hil::bench
