#pragma once
// The least and the greatest value of a signal in buckets of ticks. Buckets begin with one tick each. When
// all are used, neighbours are merged and each has twice as many ticks, so that a run of any length fits.
//
// Threads: one at a time. add() neither allocates nor blocks; merging takes a few microseconds.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "runtime/report/signal_plot_record.hpp"

namespace hil::plots {

class SeriesBuckets {
 public:
  /// `capacity` is even and at least 2.
  explicit SeriesBuckets(std::size_t capacity) : buckets_(capacity) {}

  /// The value at the end of a tick, by its number from the start of the series; NaN: not known. Numbers
  /// are strictly increasing; values of a number that is missing are not known.
  void add(std::uint64_t tick, double value) noexcept;

  std::uint64_t ticks_per_bucket() const noexcept { return std::uint64_t{1} << doublings_; }
  /// One where the values change, and one for the last bucket. Empty: no tick was added.
  std::vector<report::SignalPoint> points() const;

 private:
  struct Bucket {
    double min = contribution::not_known;
    double max = contribution::not_known;
    void include(const Bucket& other) noexcept;
  };
  void merge_neighbours() noexcept;

  std::vector<Bucket> buckets_;
  std::size_t used_ = 0;  ///< up to the newest one
  unsigned doublings_ = 0;
};

}  // namespace hil::plots
