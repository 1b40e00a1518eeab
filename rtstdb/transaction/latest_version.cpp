#include "rtstdb/transaction/latest_version.hpp"

namespace rtstdb::transaction {

void LatestVersion::set(VersionInfo version) noexcept {
  const std::uint64_t count = count_.load(std::memory_order_relaxed) + 1;
  Slot& slot = slots_[count % kept];
  slot.version.store(version.version, std::memory_order_release);
  slot.time_ns.store(version.time.time_since_epoch().count(), std::memory_order_release);
  count_.store(count, std::memory_order_release);
}

VersionInfo LatestVersion::get() const noexcept {
  while (true) {
    const std::uint64_t count = count_.load(std::memory_order_acquire);
    const Slot& slot = slots_[count % kept];
    const Version version = slot.version.load(std::memory_order_acquire);
    const std::int64_t time_ns = slot.time_ns.load(std::memory_order_acquire);
    // The writer writes this slot again for count + kept, after it has stored count + kept - 1.
    if (count_.load(std::memory_order_acquire) - count < kept - 1) return {version, world_time_ns(time_ns)};
  }
}

}  // namespace rtstdb::transaction
