#pragma once

#include "rtstdb/gpu/device_impl.hpp"

namespace rtstdb::gpu {

struct Timeline::Impl {
  std::shared_ptr<Device::Impl> device;
  vk::raii::Semaphore semaphore;
  std::uint64_t last_number = 0;

  explicit Impl(std::shared_ptr<Device::Impl> device_in);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  WaitResult wait(std::uint64_t number, std::uint64_t timeout_ns) const noexcept;
};

struct Recorder::Impl {
  enum class State : std::uint8_t { empty, recording, recorded };

  std::shared_ptr<Device::Impl> device;
  vk::raii::CommandPool pool;
  vk::raii::CommandBuffer commands;
  vk::raii::QueryPool timestamps;
  State state = State::empty;
  std::uint32_t written_slots = 0;               ///< a bit per timestamp
  bool begun = false;                            ///< false: the device was lost, and nothing is recorded
  std::shared_ptr<Timeline::Impl> submitted_to;  ///< null: never
  std::uint64_t number = 0;                      ///< of the last submission, on that timeline

  explicit Impl(std::shared_ptr<Device::Impl> device_in);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  /// True also when the device is lost: nothing will come any more.
  bool finished() const noexcept;
};

}  // namespace rtstdb::gpu
