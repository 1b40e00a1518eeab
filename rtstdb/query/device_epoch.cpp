#include "rtstdb/query/device_epoch.hpp"

#include <utility>

namespace rtstdb::query {

Result<std::unique_ptr<DeviceEpoch>> DeviceEpoch::create(std::unique_ptr<gpu::Device> device_given,
                                                         const DatabaseOptions& options,
                                                         const accel::KeptGeometries& kept) {
  std::unique_ptr<DeviceEpoch> epoch(new DeviceEpoch(std::move(device_given)));
  gpu::Device& device = epoch->device;
  const auto device_idle = std::make_shared<accel::Submit::DeviceIdle>();
  for (Lanes& lanes : epoch->lanes) {
    for (accel::Submit& lane : lanes) {
      auto submit = accel::Submit::create(device, device_idle);
      if (!submit) return submit.error();
      lane = std::move(submit).value();
    }
  }
  accel::Submit& setup = epoch->setup_lane();
  auto pool = accel::GeometryPool::create_restored(device, options.max_geometries, kept, setup);
  if (!pool) return pool.error();
  epoch->pool = std::move(pool).value();
  // Slots of large worlds take much memory: half a gigabyte for a million entities.
  const std::uint32_t slots = options.max_entities > 1u << 17 ? 2 : 4;
  auto tlas = accel::Tlas::create(device, {.max_entities = options.max_entities, .slots = slots});
  if (!tlas) return tlas.error();
  epoch->tlas = std::move(tlas).value();
  if (auto bound = epoch->rebind(); !bound) return bound.error();
  if (device.compiles_on_first_dispatch()) return epoch;
  setup.begin();
  epoch->tlas.record_warm_up(setup.recorder());
  if (!setup.run())
    return Error{ErrorCode::device_lost, "the GPU stopped answering while the database opened"};
  return epoch;
}

Result<void> DeviceEpoch::rebind() {
  if (auto bound = tlas.bind(device, pool); !bound) return bound;
  bound_generation_ = pool.generation();
  return {};
}

}  // namespace rtstdb::query
