#pragma once
// The latest published version, written by one thread and read by any without lock: the last few are kept, so
// that a reader looks at one that is not being written.

#include <array>
#include <atomic>
#include <cstdint>

#include <rtstdb/database.hpp>

namespace rtstdb::transaction {

class LatestVersion {
 public:
  explicit LatestVersion(VersionInfo first) { set(first); }
  /// One thread.
  void set(VersionInfo version) noexcept;
  /// Any thread. Tries again only when `kept` versions were published meanwhile.
  VersionInfo get() const noexcept;

 private:
  static constexpr std::uint64_t kept = 16;
  struct Slot {
    std::atomic<Version> version{0};
    std::atomic<std::int64_t> time_ns{0};
  };
  std::array<Slot, kept> slots_{};
  std::atomic<std::uint64_t> count_{0};  ///< how often set; the newest lies in slot count mod kept
};

}  // namespace rtstdb::transaction
