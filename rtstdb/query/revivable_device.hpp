#pragma once
// The executor's device and everything on it (DeviceEpoch): opens it, and replaces it after a loss.
//
// A lost device takes its whole epoch with it. The next epoch is made from what the host keeps: geometry, and
// the compiled kernels that the lost device handed out. A prepared query moves to the new device when it runs
// there for the first time.
//
// Threads: the engine's, except health and shape_counts: any.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "rtstdb/query/device_epoch.hpp"
#include "rtstdb/query/prepared_queries.hpp"
#include "rtstdb/query/revival_pace.hpp"

namespace rtstdb::query {

/// Opens a device, the first one and every one after a loss. `compiled`: what the one before had compiled
/// (gpu::Device::compiled).
using OpenDevice =
    std::function<Result<std::unique_ptr<gpu::Device>>(const std::vector<std::byte>& compiled)>;

class RevivableDevice {
 public:
  /// `queries` outlives it.
  RevivableDevice(OpenDevice open, const DatabaseOptions& options, PreparedQueries& queries)
      : open_(std::move(open)), options_(options), queries_(queries) {}

  /// Opens the first device. Errors: those of OpenDevice and DeviceEpoch::create.
  Result<void> open();

  bool lost() const noexcept { return epoch_ == nullptr || epoch_->device.lost() || broken_; }
  /// Not while lost().
  DeviceEpoch& epoch() noexcept { return *epoch_; }
  const DeviceEpoch& epoch() const noexcept { return *epoch_; }
  /// Number of the epoch; the first is 1.
  std::uint32_t epoch_number() const noexcept { return epoch_number_; }

  enum class Patience : std::uint8_t {
    keeps_pace,     ///< not before the pause after a failure is over (RevivalPace)
    tries_at_once,  ///< setup
  };
  /// Opens another device where this one is lost. Errors: device_lost, out_of_memory.
  Result<void> revive(Patience patience);
  /// How long the last one took to open.
  Nanoseconds revival_takes() const noexcept { return revival_took_; }

  /// Executes a setup step, and once more where the device is lost during the first attempt. An exception
  /// breaks the epoch: it is not known what was left half done.
  template <class Step>
  auto execute_setup(Step step) -> decltype(step());
  /// Something was left half done on the device: another epoch replaces this one.
  void mark_broken() noexcept { broken_ = true; }
  /// The geometries of the pool count from now on; a lost device takes later ones with it.
  void keep_geometries() noexcept { geometry_count_ = epoch_->pool.count(); }
  std::uint32_t geometry_count() const noexcept { return geometry_count_; }
  /// A run has ended with answers.
  void note_answered() noexcept { pace_.answered(); }
  /// Makes the epoch's counts visible to shape_counts.
  void publish_counts() noexcept;

  ShapeCounts shape_counts() const noexcept {
    return {refits_.load(std::memory_order_relaxed), builds_.load(std::memory_order_relaxed)};
  }
  /// All but `degraded`.
  Health health() const;

 private:
  Result<void> make_epoch(bool compiles_late);
  /// Destroys everything on the device, except what queries that are being destroyed have there.
  void drop_epoch();
  Result<void> not_revived(const Error& why);

  const OpenDevice open_;
  const DatabaseOptions options_;
  PreparedQueries& queries_;
  accel::KeptGeometries kept_;       ///< of the epoch before; an epoch has its own
  std::vector<std::byte> compiled_;  ///< by the epochs before
  std::uint32_t geometry_count_ = 0;
  std::unique_ptr<DeviceEpoch> epoch_;
  std::uint32_t epoch_number_ = 0;
  bool broken_ = false;
  RevivalPace pace_;
  Nanoseconds revival_took_{0};
  ShapeCounts shapes_before_;  ///< of the epochs before
  std::atomic<std::uint64_t> refits_{0}, builds_{0};

  mutable std::mutex health_mutex_;  ///< protects the rest, and changes of epoch_, which health reads
  bool loss_counted_ = false;        ///< of this epoch
  Health health_;
};

template <class Step>
auto RevivableDevice::execute_setup(Step step) -> decltype(step()) {
  for (bool second = false;; second = true) {
    try {
      if (auto revived = revive(Patience::tries_at_once); !revived) return revived.error();
      auto result = step();
      if (second || result.ok() || !lost()) return result;
    } catch (...) {
      broken_ = true;
      throw;
    }
  }
}

}  // namespace rtstdb::query
