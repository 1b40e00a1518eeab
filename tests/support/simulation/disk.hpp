#pragma once
// A disk in memory with the worst behaviour of real disks, from a seed: calls that fail, a full disk, slow
// calls, and crashes. After a crash, synced data is there, of sectors written later any subset, and of later
// changes of names any subset. A sync of a file that fails drops its unwritten data, and later syncs do not
// report that.
//
// Threads: as for the port. Any thread may set faults at any time.

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "rtstdb/log/disk.hpp"

namespace hil::tests {

class SimulatedDisk final : public rtstdb::log::Disk {
 public:
  using DiskCall = rtstdb::log::DiskCall;
  template <class T>
  using Result = rtstdb::log::DiskResult<T>;
  using Fault = rtstdb::log::DiskFault;

  using Contents = std::map<std::string, std::vector<std::byte>>;

  explicit SimulatedDisk(std::uint64_t seed) : random_(seed) {}
  /// All of `contents` is on disk.
  SimulatedDisk(std::uint64_t seed, const Contents& contents) : SimulatedDisk(seed) {
    set_contents(contents);
  }

  // ---- what goes wrong

  /// The number of calls of the port, on the directory or a file.
  std::uint64_t calls() const noexcept { return calls_; }
  /// The call with that number (from 0) fails with that errno.
  void fail_call(std::uint64_t number, int error_number) {
    const std::lock_guard lock(mutex_);
    failing_[number] = error_number;
  }
  /// Each call fails with EIO with that probability; reads do not fail.
  void fail_per_mille(std::uint32_t chance) {
    const std::lock_guard lock(mutex_);
    chance_ = chance;
  }
  /// All calls of that kind fail; 0: they do not.
  void fail_kind(DiskCall call, int error_number) {
    const std::lock_guard lock(mutex_);
    failing_kinds_[call] = error_number;
  }
  /// The files can not grow beyond that sum of bytes.
  void set_capacity(std::uint64_t bytes) {
    const std::lock_guard lock(mutex_);
    capacity_ = bytes;
  }
  /// Called before each call, without a lock: it may wait, or advance a clock.
  void before_each(std::function<void(DiskCall)> hook) {
    const std::lock_guard lock(mutex_);
    hook_ = std::move(hook);
  }

  /// A power failure. Open files become invalid.
  void crash();
  /// The end of the process: later processes read all written data, which is not on disk for that.
  void kill() { ++life_; }
  /// What a crash keeps of unsynced data: a random subset of sectors (the default), nothing, or everything.
  enum class Keeps : std::uint8_t { any, nothing, everything };
  void at_crash_keep(Keeps keeps) {
    const std::lock_guard lock(mutex_);
    keeps_ = keeps;
  }

  // ---- for damage and comparison

  Contents contents() const;
  void set_contents(const Contents& contents);

  // ---- the port

  Result<std::unique_ptr<rtstdb::log::DiskFile>> create(std::string_view name) override;
  Result<std::unique_ptr<rtstdb::log::DiskFile>> open(std::string_view name) override;
  Result<std::vector<std::string>> list() override;
  Fault rename(std::string_view from, std::string_view to) override;
  Fault remove(std::string_view name) override;
  Fault sync_directory() override;
  Result<std::unique_ptr<rtstdb::log::DiskLock>> lock(std::string_view name) override;

 private:
  friend class SimulatedFile;
  friend class SimulatedLock;
  struct Content {
    std::vector<std::byte> now;
    std::vector<std::byte> on_disk;
    std::set<std::uint64_t> dirty;  ///< sectors that a sync writes
    bool size_dirty = false;
  };
  using Names = std::map<std::string, std::shared_ptr<Content>, std::less<>>;
  struct Change {
    std::string from;  ///< empty: `content` is new
    std::string to;    ///< empty: removed
    std::shared_ptr<Content> content;
  };

  /// Counts the call. Returns the errno that it fails with, or 0.
  int enter(DiskCall call);
  bool draw() { return keeps_ == Keeps::any ? random_() % 2 == 0 : keeps_ == Keeps::everything; }
  static void apply(const Change& change, Names& names);
  static void put_on_disk(Content& content, std::uint64_t sector);
  void drop_dirty(Content& content);
  std::uint64_t bytes_in_use() const;

  mutable std::mutex mutex_;
  std::mt19937_64 random_;
  Names now_, on_disk_;
  std::vector<Change> changes_;  // of names, since the directory was synced
  std::map<std::uint64_t, int> failing_;
  std::map<DiskCall, int> failing_kinds_;
  std::uint32_t chance_ = 0;
  std::uint64_t capacity_ = ~std::uint64_t{0};
  std::function<void(DiskCall)> hook_;
  std::atomic<std::uint64_t> calls_{0};
  std::atomic<std::uint64_t> life_{0};  // handles of an earlier one are stale
  Keeps keeps_ = Keeps::any;
  std::uint64_t locked_in_ = ~std::uint64_t{0};
};

}  // namespace hil::tests
