#pragma once
// What all families of figures share: both sides in alternation with two threads each, and the error that
// ends a bench.

#include <cstddef>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <rtstdb/result.hpp>

#include "bench/figure/figure.hpp"
#include "bench/figure/suite.hpp"

namespace hil::bench {

/// Threads of either side, whatever the machine has; a GPU uses its own.
inline constexpr unsigned threads_per_side = 2;
/// Limits lavapipe to this number unless the user has set a limit. Before the first device is opened.
void limit_software_device();

double seconds_of(const std::function<void()>& work);

struct RoundTimes {
  std::vector<double> ours_s, theirs_s;
};

/// Runs both once to warm up, then `rounds` times each; the first one alternates.
RoundTimes in_turns(int rounds, const std::function<void()>& ours, const std::function<void()>& theirs);

/// Runs one round without warm-up.
RoundTimes once_each(bool we_begin, const std::function<void()>& ours, const std::function<void()>& theirs);

/// Calls `each(begin, end)` for chunks of [0, count) on threads_per_side threads, as the threads become free.
void over_chunks(std::size_t count, std::size_t chunk,
                 const std::function<void(std::size_t begin, std::size_t end)>& each);

/// Elements per second.
struct RateUnit {
  double things = 1.0;
  const char* name = "";
};
inline constexpr RateUnit mega_rays{1e6, "Mray/s"};
inline constexpr RateUnit kilo_queries{1e3, "kquery/s"};

/// What is measured in alternation, and its name.
struct RateComparison {
  std::string name;
  RateUnit unit;
  std::size_t things = 0;  ///< in one run
  int rounds = 0;
  std::function<double()> ours;  ///< returns the seconds that the device itself was busy
  std::string peer;
  std::function<void()> theirs;
};
/// The figure `name` with the peer's, and `name`_device by the device's own time.
std::vector<Figure> rates(const RateComparison& comparison);
/// In milliseconds.
Figure time_figure(const std::string& name, const RoundTimes& times, const std::string& peer);

/// Throws std::runtime_error with the text of the error.
template <class Value>
Value must(rtstdb::Result<Value> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(result).value();
}
inline void must(const rtstdb::Result<void>& result) {
  if (!result) throw std::runtime_error(result.error().message);
}

}  // namespace hil::bench
