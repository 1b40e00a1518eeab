#pragma once
// The most recent versions with their times, ascending in version and in time. A ring of fixed size.
// Allocates only in the constructor.
// Threads: one.

#include <cstddef>
#include <optional>
#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::store {

class VersionHistory {
 public:
  VersionHistory(std::size_t size, VersionInfo first);

  /// Removes all versions; this one becomes the oldest.
  void begin_at(VersionInfo version) noexcept {
    oldest_ = count_ = 0;
    append(version);
  }

  /// The version must increase; the time must not decrease.
  void append(VersionInfo version) noexcept;
  VersionInfo newest() const noexcept { return at(count_ - 1); }
  VersionInfo oldest() const noexcept { return at(0); }
  /// Whether a version that is in the ring now will still be there after one more.
  bool keeps_after_one_more(Version version) const noexcept {
    return count_ < ring_.size() || version > oldest().version;
  }

  /// That version; none if it does not exist or has left the ring.
  std::optional<VersionInfo> find(Version version) const noexcept;
  /// The version that covers `time`; none if all versions in the ring begin later.
  std::optional<VersionInfo> at_time(WorldTime time) const noexcept;

 private:
  const VersionInfo& at(std::size_t position) const noexcept {
    return ring_[(oldest_ + position) % ring_.size()];
  }
  /// Number of versions in the ring that satisfy `holds`, which is true for a prefix of them. Binary search.
  template <class Predicate>
  std::size_t count_prefix(Predicate holds) const noexcept {
    std::size_t low = 0;
    std::size_t high = count_;
    while (low < high) {
      const std::size_t middle = low + (high - low) / 2;
      if (holds(at(middle))) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  std::vector<VersionInfo> ring_;
  std::size_t oldest_ = 0;
  std::size_t count_ = 0;
};

}  // namespace rtstdb::store
