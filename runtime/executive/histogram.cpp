#include "runtime/executive/histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace hil::executive {
namespace {

constexpr int sub_bits = 7;
constexpr std::int64_t sub_buckets = std::int64_t{1} << sub_bits;
constexpr std::int64_t linear_buckets = 2 * sub_buckets;
constexpr int value_bits = 42;
constexpr std::int64_t largest_ns = (std::int64_t{1} << value_bits) - 1;
constexpr std::int64_t bucket_count = linear_buckets + (value_bits - sub_bits - 1) * sub_buckets;

std::int64_t bucket_of(std::int64_t value_ns) noexcept {
  if (value_ns < linear_buckets) return value_ns;
  const auto shift =
      static_cast<std::int64_t>(std::bit_width(static_cast<std::uint64_t>(value_ns))) - (sub_bits + 1);
  return linear_buckets + (shift - 1) * sub_buckets + ((value_ns >> shift) - sub_buckets);
}

Histogram::Bucket bounds_of(std::int64_t index) noexcept {
  if (index < linear_buckets) return {index, index, 0};
  const std::int64_t shift = (index - linear_buckets) / sub_buckets + 1;
  const std::int64_t top = (index - linear_buckets) % sub_buckets + sub_buckets;
  return {top << shift, ((top + 1) << shift) - 1, 0};
}

}  // namespace

Histogram::Histogram() : counts_(static_cast<std::size_t>(bucket_count)) {}

void Histogram::record(std::int64_t value_ns) noexcept {
  value_ns = std::max<std::int64_t>(value_ns, 0);
  ++counts_[static_cast<std::size_t>(bucket_of(std::min(value_ns, largest_ns)))];
  min_ns_ = count_ == 0 ? value_ns : std::min(min_ns_, value_ns);
  max_ns_ = std::max(max_ns_, value_ns);
  total_ns_ += value_ns;
  ++count_;
}

std::int64_t Histogram::quantile_ns(double share) const noexcept {
  if (count_ == 0) return 0;
  const double exact_rank = std::ceil(std::clamp(share, 0.0, 1.0) * static_cast<double>(count_));
  const auto rank = std::clamp<std::uint64_t>(static_cast<std::uint64_t>(exact_rank), 1, count_);
  if (rank == count_) return max_ns_;
  std::uint64_t seen = 0;
  for (std::int64_t index = 0; index < bucket_count; ++index) {
    seen += counts_[static_cast<std::size_t>(index)];
    if (seen < rank) continue;
    const Bucket bucket = bounds_of(index);
    return std::clamp(bucket.first_ns + (bucket.last_ns - bucket.first_ns) / 2, min_ns_, max_ns_);
  }
  return max_ns_;
}

Quantiles Histogram::quantiles() const noexcept {
  return {quantile_ns(0.5), quantile_ns(0.99), quantile_ns(0.999), max_ns_};
}

std::vector<Histogram::Bucket> Histogram::filled_buckets() const {
  std::vector<Bucket> filled;
  for (std::int64_t index = 0; index < bucket_count; ++index) {
    Bucket bucket = bounds_of(index);
    bucket.count = counts_[static_cast<std::size_t>(index)];
    if (bucket.count > 0) filled.push_back(bucket);
  }
  return filled;
}

}  // namespace hil::executive
