#pragma once
// Everything that the executor has on a device, with the device itself. When the device is lost, the whole
// epoch is destroyed and a new one is created from the host's copies. Queries own their part
// (GpuQuery::move_to).
//
// Threads: the engine thread.

#include <array>
#include <memory>
#include <optional>

#include "rtstdb/accel/field_sampler.hpp"
#include "rtstdb/accel/geometry_pool.hpp"
#include "rtstdb/accel/tlas.hpp"
#include "rtstdb/query/chunked_run.hpp"

namespace rtstdb::query {

class DeviceEpoch {
 public:
  /// With the geometries in `kept`. On a device that compiles late, no kernel is compiled here. Errors:
  /// capacity and out_of_memory of the device; device_lost.
  static Result<std::unique_ptr<DeviceEpoch>> create(std::unique_ptr<gpu::Device> device_given,
                                                     const DatabaseOptions& options,
                                                     const accel::KeptGeometries& kept);
  /// Binds the slots to the pool; again whenever the pool's generation has changed.
  Result<void> rebind();
  bool is_bound() const noexcept { return bound_generation_ == pool.generation(); }

 private:
  explicit DeviceEpoch(std::unique_ptr<gpu::Device> device_given) : owned_device_(std::move(device_given)) {}

  std::unique_ptr<gpu::Device> owned_device_;
  std::uint32_t bound_generation_ = 0;

 public:
  gpu::Device& device = *owned_device_;
  accel::GeometryPool pool;
  std::optional<accel::FieldSampler> field_sampler;  ///< from the first build of a distance field on
  accel::Tlas tlas;
  Structures structures{device, pool, tlas};
  std::array<Lanes, max_nesting + 1> lanes;  ///< by nesting depth: each nested run has its own
  accel::Submit& setup_lane() noexcept { return lanes[0][0]; }
};

}  // namespace rtstdb::query
