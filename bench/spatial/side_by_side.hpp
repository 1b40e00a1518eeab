#pragma once
// What every family of figures shares: both sides in turns, two threads each, and the failure that ends a
// bench.

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

/// Of either side, whatever the machine has; a GPU has its own.
inline constexpr unsigned threads_per_side = 2;
/// Tells lavapipe, unless the user has told it otherwise. Before the first device is opened.
void limit_software_device();

double seconds_of(const std::function<void()>& work);

struct RoundTimes {
  std::vector<double> ours_s, theirs_s;
};

/// Both once to warm up, then `rounds` times each; who begins takes turns.
RoundTimes in_turns(int rounds, const std::function<void()>& ours, const std::function<void()>& theirs);

/// One round, without warming up.
RoundTimes once_each(bool we_begin, const std::function<void()>& ours, const std::function<void()>& theirs);

/// `each(begin, end)` over chunks of [0, count) as they come free, on threads_per_side threads.
void over_chunks(std::size_t count, std::size_t chunk,
                 const std::function<void(std::size_t begin, std::size_t end)>& each);

/// Things in a second.
struct RateUnit {
  double things = 1.0;
  const char* name = "";
};
inline constexpr RateUnit mega_rays{1e6, "Mray/s"};
inline constexpr RateUnit kilo_queries{1e3, "kquery/s"};

/// What is measured in turns, and how to call it.
struct RateComparison {
  std::string name;
  RateUnit unit;
  std::size_t things = 0;  ///< in one run
  int rounds = 0;
  std::function<double()> ours;  ///< returns the seconds that the device itself was busy
  std::string peer;
  std::function<void()> theirs;
};
/// `name` beside the peer, and `name`_device by the device's own time alone.
std::vector<Figure> rates(const RateComparison& comparison);
/// Milliseconds.
Figure time_figure(const std::string& name, const RoundTimes& times, const std::string& peer);

/// Throws std::runtime_error with the refusal's words.
template <class Value>
Value must(rtstdb::Result<Value> result) {
  if (!result) throw std::runtime_error(result.error().message);
  return std::move(result).value();
}
inline void must(const rtstdb::Result<void>& result) {
  if (!result) throw std::runtime_error(result.error().message);
}

}  // namespace hil::bench
