#pragma once
// A histogram of durations with a fixed size: linear up to 255 ns, then 128 buckets per power of two up to
// 2^42 ns (73 minutes). A bucket's width is at most 1/128 of its values and a quantile is reported as the
// bucket's middle, so its relative error is below 0.4 %. Minimum, maximum, count and total are exact.
// Recording neither allocates nor locks.
//
// Threads: one at a time.

#include <cstdint>
#include <vector>

namespace hil::executive {

struct Quantiles {
  std::int64_t p50_ns = 0;
  std::int64_t p99_ns = 0;
  std::int64_t p999_ns = 0;
  std::int64_t max_ns = 0;
};

class Histogram {
 public:
  struct Bucket {
    std::int64_t first_ns = 0;  ///< smallest value of the bucket
    std::int64_t last_ns = 0;   ///< largest value of the bucket
    std::uint64_t count = 0;
  };

  Histogram();

  /// Negative values count as 0. Values above 2^42 - 1 ns count in the last bucket; max_ns() reports them
  /// exactly.
  void record(std::int64_t value_ns) noexcept;

  std::uint64_t count() const noexcept { return count_; }
  std::int64_t total_ns() const noexcept { return total_ns_; }
  /// 0 when nothing was recorded, as for all results of an empty histogram.
  std::int64_t min_ns() const noexcept { return count_ == 0 ? 0 : min_ns_; }
  std::int64_t max_ns() const noexcept { return max_ns_; }
  /// The value that the fraction `share` (0 to 1) of the recorded values does not exceed.
  std::int64_t quantile_ns(double share) const noexcept;
  Quantiles quantiles() const noexcept;
  /// The non-empty buckets, in ascending order.
  std::vector<Bucket> filled_buckets() const;

 private:
  std::vector<std::uint64_t> counts_;
  std::uint64_t count_ = 0;
  std::int64_t total_ns_ = 0;
  std::int64_t min_ns_ = 0;
  std::int64_t max_ns_ = 0;
};

}  // namespace hil::executive
