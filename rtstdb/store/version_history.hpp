#pragma once
// From when each of the last versions holds. A ring of fixed size, ascending in version and in time;
// allocates in the constructor alone. One thread.

#include <cstddef>
#include <optional>
#include <vector>

#include <rtstdb/database.hpp>

namespace rtstdb::store {

class VersionHistory {
 public:
  VersionHistory(std::size_t size, VersionInfo first);

  /// Forgets what it has; this is the oldest now.
  void begin_at(VersionInfo version) noexcept {
    oldest_ = count_ = 0;
    append(version);
  }

  /// Neither version nor time goes back.
  void append(VersionInfo version) noexcept;
  VersionInfo newest() const noexcept { return at(count_ - 1); }
  VersionInfo oldest() const noexcept { return at(0); }
  /// Whether a version that is remembered now will be after one more.
  bool keeps_after_one_more(Version version) const noexcept {
    return count_ < ring_.size() || version > oldest().version;
  }

  /// Exactly that version; none when it never was or is forgotten.
  std::optional<VersionInfo> find(Version version) const noexcept;
  /// The newest version that had begun at `time`; none when all that are remembered begin later.
  std::optional<VersionInfo> at_time(WorldTime time) const noexcept;

 private:
  const VersionInfo& at(std::size_t position) const noexcept {
    return ring_[(oldest_ + position) % ring_.size()];
  }
  /// How many of the remembered versions satisfy `holds`, which is true for a prefix of them.
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
