#pragma once
// The latest published version, written by one thread and read by any without a lock: a ring of the last
// versions, so that a reader reads a slot that is not being written.

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
  /// Any thread. Retries only when about `kept` versions were published during the call.
  VersionInfo get() const noexcept;

 private:
  static constexpr std::uint64_t kept = 16;
  struct Slot {
    std::atomic<Version> version{0};
    std::atomic<std::int64_t> time_ns{0};
  };
  std::array<Slot, kept> slots_{};
  std::atomic<std::uint64_t> count_{0};  ///< calls of set; the latest lies in slot count mod kept
};

}  // namespace rtstdb::transaction
