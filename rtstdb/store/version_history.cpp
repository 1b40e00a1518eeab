#include "rtstdb/store/version_history.hpp"

#include <rtstdb/result.hpp>

namespace rtstdb::store {

VersionHistory::VersionHistory(std::size_t size, VersionInfo first) : ring_(size) {
  RTSTDB_ASSERT(size >= 1, "no version is retained");
  append(first);
}

void VersionHistory::append(VersionInfo version) noexcept {
  RTSTDB_ASSERT(count_ == 0 || (version.version > newest().version && version.time >= newest().time),
                "the version or its time is before the newest one");
  if (count_ == ring_.size()) {
    ring_[oldest_] = version;
    oldest_ = (oldest_ + 1) % ring_.size();
    return;
  }
  ring_[(oldest_ + count_) % ring_.size()] = version;
  ++count_;
}

std::optional<VersionInfo> VersionHistory::find(Version version) const noexcept {
  const std::size_t older = count_prefix([&](const VersionInfo& info) { return info.version < version; });
  if (older == count_ || at(older).version != version) return std::nullopt;
  return at(older);
}

std::optional<VersionInfo> VersionHistory::at_time(WorldTime time) const noexcept {
  const std::size_t begun = count_prefix([&](const VersionInfo& info) { return info.time <= time; });
  if (begun == 0) return std::nullopt;
  return at(begun - 1);
}

}  // namespace rtstdb::store
