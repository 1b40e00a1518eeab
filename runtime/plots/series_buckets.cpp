#include "runtime/plots/series_buckets.hpp"

#include <bit>
#include <cmath>

namespace hil::plots {
namespace {

/// Equal, or both NaN.
bool same(double a, double b) {
  return a == b || (std::isnan(a) && std::isnan(b));
}

}  // namespace

void SeriesBuckets::Bucket::include(const Bucket& other) noexcept {
  min = std::fmin(min, other.min);
  max = std::fmax(max, other.max);
}

void SeriesBuckets::add(std::uint64_t tick, double value) noexcept {
  while ((tick >> doublings_) >= buckets_.size())
    merge_neighbours();
  const std::size_t index = tick >> doublings_;
  used_ = index + 1;
  buckets_[index].include({value, value});
}

void SeriesBuckets::merge_neighbours() noexcept {
  for (std::size_t i = 0; i < buckets_.size() / 2; ++i) {
    Bucket merged = buckets_[2 * i];
    merged.include(buckets_[2 * i + 1]);
    buckets_[i] = merged;
  }
  for (std::size_t i = buckets_.size() / 2; i < buckets_.size(); ++i)
    buckets_[i] = {};
  ++doublings_;
}

std::vector<report::SignalPoint> SeriesBuckets::points() const {
  std::vector<report::SignalPoint> points;
  for (std::size_t i = 0; i < used_; ++i) {
    const Bucket& bucket = buckets_[i];
    const bool is_new =
        points.empty() || !same(points.back().min, bucket.min) || !same(points.back().max, bucket.max);
    if (is_new || i + 1 == used_) points.push_back({i, bucket.min, bucket.max});
  }
  return points;
}

}  // namespace hil::plots
