#pragma once
// The plots of signals in the record of a run (run_record.hpp has the units).
//
// A series has the values of a signal at the ends of ticks, in buckets of one width: bucket k has the ticks
// from begin_ns + k * bucket_ns on, before begin_ns + (k + 1) * bucket_ns. With one tick in a bucket the
// values are exact; else a bucket has the least and the greatest one, so that no peak is lost.
//
// Threads: plain data.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <hil/section.hpp>

namespace hil::report {

/// The values from this bucket to the one of the next point. NaN: not known.
struct SignalPoint {
  std::uint64_t bucket = 0;
  double min = contribution::not_known;
  double max = contribution::not_known;
  bool operator==(const SignalPoint&) const = default;
};

enum class SeriesKind : std::uint8_t {
  signal,
  faulted,    ///< what the readers of the signal get while a fault acts on it
  reference,  ///< the curve that an expectation compares the signal with
};

struct NamedValue {
  double value = 0.0;
  std::string name;
};

struct SignalSeries {
  std::string name;
  SeriesKind kind = SeriesKind::signal;
  std::string unit;
  double tolerance = contribution::not_known;  ///< of a reference: the largest error
  std::vector<NamedValue> named_values;        ///< of a bus
  std::int64_t begin_ns = 0;
  std::int64_t bucket_ns = 0;
  std::vector<SignalPoint>
      points;  ///< buckets are strictly increasing; the last one is that of the last tick
};

/// A constant of a comparison of a signal by < <= > >=, or a limit of its statistics, in the signal's unit.
struct SignalLimit {
  std::uint32_t series = 0;  ///< index in SignalPlots::series
  double value = contribution::not_known;
};

/// What a test table expects of a signal at an instant, in the signal's unit.
struct SignalInstant {
  std::uint32_t series = 0;  ///< index in SignalPlots::series
  std::int64_t time_ns = 0;
  double value = contribution::not_known;
  double tolerance = contribution::not_known;
};

struct SignalPlot {
  std::string title;
  std::vector<std::uint32_t>
      expectations;                   ///< indices in RunRecord::expectations: those that read the signals
  std::vector<std::uint32_t> series;  ///< indices in SignalPlots::series
  std::vector<SignalLimit> limits;
  std::vector<SignalInstant> instants{};
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

/// The most series in the plots of expectations, references not counted.
inline constexpr std::size_t max_expectation_series = 64;

struct SignalPlots {
  std::vector<SignalSeries> series;
  std::vector<SignalPlot> plots;
  std::vector<std::string> not_plotted;  ///< expectations whose signals are too many
};

}  // namespace hil::report
