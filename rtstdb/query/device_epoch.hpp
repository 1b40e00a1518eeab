#pragma once
// All that the executor has on a device, from the device itself on: it comes and goes as one. When the device is lost,
// another one is made from what the host keeps. Queries have their own part of it (GpuQuery::move_to).
//
// Threads: the database's.

#include <array>
#include <memory>

#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/chunked_run.hpp"

namespace rtstdb::query {

class DeviceEpoch {
 public:
  /// With what `kept` says; on a device that compiles late nothing is compiled. Errors: what the device can not hold;
  /// device_lost.
  static Result<std::unique_ptr<DeviceEpoch>> create(std::unique_ptr<gpu::Device> device_given,
                                                     const DatabaseOptions& options,
                                                     const accel::KeptGeometries& kept);
  /// The slots to the pool; again whenever the pool's generation has changed.
  Result<void> rebind();
  bool is_bound() const noexcept { return bound_generation_ == pool.generation(); }

 private:
  explicit DeviceEpoch(std::unique_ptr<gpu::Device> device_given) : owned_device_(std::move(device_given)) {}

  std::unique_ptr<gpu::Device> owned_device_;
  std::uint32_t bound_generation_ = 0;

 public:
  gpu::Device& device = *owned_device_;
  accel::GeometryPool pool;
  accel::Tlas tlas;
  Structures structures{device, pool, tlas};
  std::array<Lanes, max_nesting + 1> lanes;  ///< by depth: a run in another's gap has its own
  accel::Submit& setup_lane() noexcept { return lanes[0][0]; }
};

}  // namespace rtstdb::query
