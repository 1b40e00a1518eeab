#include "rtstdb/query/revivable_device.hpp"

#include <chrono>
#include <exception>
#include <string>
#include <utility>

#include "rtstdb/query/gpu_query.hpp"

namespace rtstdb::query {
namespace {

using Clock = std::chrono::steady_clock;

std::string milliseconds(Clock::duration duration) {
  return std::to_string(std::chrono::ceil<std::chrono::milliseconds>(duration).count()) + " ms";
}

std::string times(std::uint64_t count) {
  return count == 1 ? "once" : std::to_string(count) + " times";
}

}  // namespace

Result<void> RevivableDevice::open() {
  const auto begun = Clock::now();
  if (auto made = make_epoch(false); !made) return made;
  revival_took_ = Clock::now() - begun;
  return {};
}

Result<void> RevivableDevice::make_epoch(bool compiles_late) {
  auto device = open_(compiled_);
  if (!device) return device.error();
  device.value()->compile_on_first_dispatch(compiles_late);
  auto epoch = DeviceEpoch::create(std::move(device).value(), options_, kept_);
  if (!epoch) return epoch.error();
  const std::lock_guard lock(health_mutex_);
  epoch_ = std::move(epoch).value();
  ++epoch_number_;
  loss_counted_ = false;
  broken_ = false;
  return {};
}

void RevivableDevice::drop_epoch() {
  kept_ = epoch_->pool.kept();
  kept_.resize(geometry_count_);  // without a geometry that was being added
  if (auto compiled = epoch_->device.pipeline_cache_data(); !compiled.empty())
    compiled_ = std::move(compiled);
  shapes_before_ = shape_counts();
  queries_.visit([](GpuQuery& query) {
    query.leave_device();
    query.epoch = 0;
    return true;
  });
  const std::lock_guard lock(health_mutex_);
  for (std::string& message : epoch_->device.validation_messages())
    health_.validation_messages.push_back(std::move(message));
  epoch_.reset();
}

Result<void> RevivableDevice::revive(Patience patience) {
  if (!lost()) return {};
  const auto begun = Clock::now();
  if (epoch_ != nullptr) {
    if (epoch_->device.lost() && !loss_counted_) {
      pace_.failed(begun);
      const std::lock_guard lock(health_mutex_);
      loss_counted_ = true;
      ++health_.device_losses;
    }
    drop_epoch();
  }
  if (patience == Patience::keeps_pace && !pace_.may_try(begun))
    return Error{ErrorCode::device_lost, health_.device_loss};
  try {
    if (const auto made = make_epoch(true); !made) return not_revived(made.error());
  } catch (const std::exception& fault) {
    static_cast<void>(not_revived({ErrorCode::out_of_memory, fault.what()}));
    throw;
  }
  revival_took_ = Clock::now() - begun;
  const std::lock_guard lock(health_mutex_);
  health_.device_lost = false;
  if (health_.device_losses > 0) {
    health_.device_loss = "the device was lost " + times(health_.device_losses) + "; the last time " +
                          epoch_->device.info().name + " took its place after " + milliseconds(revival_took_);
  }
  return {};
}

Result<void> RevivableDevice::not_revived(const Error& why) {
  const auto now = Clock::now();
  pace_.failed(now);
  const std::lock_guard lock(health_mutex_);
  health_.device_lost = true;
  health_.device_loss = "the device is lost and could not be opened again: " + why.message +
                        "; the next attempt is in " + milliseconds(pace_.left(now));
  const bool no_memory = why.code == ErrorCode::out_of_memory;
  return Error{no_memory ? why.code : ErrorCode::device_lost, health_.device_loss};
}

void RevivableDevice::publish_counts() noexcept {
  const accel::GeometryPool::Counts counts = epoch_->pool.counts();
  refits_.store(shapes_before_.refits + counts.refits, std::memory_order_relaxed);
  builds_.store(shapes_before_.rebuilds + counts.builds, std::memory_order_relaxed);
}

Health RevivableDevice::health() const {
  const std::lock_guard lock(health_mutex_);
  Health health = health_;
  if (epoch_ == nullptr) return health;
  health.device_lost = epoch_->device.lost();
  if (health.device_lost && !loss_counted_) ++health.device_losses;
  for (std::string& message : epoch_->device.validation_messages())
    health.validation_messages.push_back(std::move(message));
  return health;
}

}  // namespace rtstdb::query
