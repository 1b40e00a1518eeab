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
  std::uint32_t written_slots = 0;  ///< one bit per timestamp slot
  bool begun = false;               ///< false: the device was lost at begin(), so commands are ignored
  std::shared_ptr<Timeline::Impl> submitted_to;  ///< null: never submitted
  std::uint64_t number = 0;                      ///< of the last submission, on `submitted_to`

  explicit Impl(std::shared_ptr<Device::Impl> device_in);
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl();

  /// Whether the last submission has finished. True also when the device is lost, since it then never will.
  bool finished() const noexcept;
};

}  // namespace rtstdb::gpu
