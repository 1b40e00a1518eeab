#pragma once
// One recorder and one timeline used in turn: record, start, finish. Several may be under way at a time; the
// device takes them in the order of their starts.

#include <glm/vec2.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <utility>

#include "rtstdb/gpu/device.hpp"
#include "rtstdb/query/executor.hpp"

namespace rtstdb::accel {

/// When what is started may be halted.
struct Halting {
  std::chrono::nanoseconds halt_after{0};  ///< the device has been at it for so long; zero: never
  bool at_once = false;                    ///< sooner, where finish is told that it is awaited
};

class Submit {
 public:
  /// When the device was last seen to be done; what is timed by the host begins no earlier.
  using DeviceFree = std::chrono::steady_clock::time_point;

  /// Those that may be under way together share `device_free`.
  static Result<Submit> create(gpu::Device& device,
                               std::shared_ptr<DeviceFree> device_free = std::make_shared<DeviceFree>());

  /// The recorder, begun.
  gpu::Recorder& recorder() noexcept { return recorder_; }
  void begin();
  /// From now on finish() tells this about its waits; null: nobody.
  void while_waiting(query::ExecutorCallbacks* callbacks) noexcept { callbacks_ = callbacks; }
  /// Ends the recorder and submits it. False: the device is lost.
  bool start(const Halting& halting = {});
  /// Waits for what was started; asked again, it says the same. False: the device is lost. Halted it is where
  /// somebody waits for it to end (`awaited`, or ExecutorCallbacks::preemption_requested), and `behind` with
  /// it, which was started after it.
  bool finish(bool awaited = false, Submit* behind = nullptr);
  bool run() { return start() && finish(); }

  /// For dispatches that can be halted (shaders/common/halt.glsl); zero where none can be: the device does
  /// not share the host's memory.
  glm::uvec2 halt_address() const noexcept { return halt_ ? halt_.address() : glm::uvec2(0); }
  /// Of what was finished last: the first of its elements that did not begin, since it was halted; or beyond
  /// all.
  std::uint32_t first_unstarted() const noexcept;
  /// What was finished last was halted sooner than when the device had been at it for long.
  bool halted_at_once() const noexcept { return halted_at_once_; }
  /// Of a device that is timed by the host: what was finished last had been done before finish was called,
  /// and took less than was measured.
  bool completed_before_wait() const noexcept { return seen_late_; }
  /// Time that the device spent on all runs since the last call. A device that is the processor itself is
  /// timed by the host, from the submission until the wait is over: lavapipe draws a scene with all its
  /// threads for each timestamp, which takes longer than a small dispatch.
  std::int64_t take_gpu_ns() noexcept { return std::exchange(gpu_ns_, 0); }

 private:
  /// For what is under way.
  gpu::WaitResult wait(bool awaited, Submit* behind);
  void halt() noexcept;

  gpu::Recorder recorder_;
  gpu::Timeline timeline_;
  std::shared_ptr<DeviceFree> device_free_;
  DeviceFree started_;
  std::uint64_t under_way_ = 0;  // its number; 0: nothing
  gpu::Buffer halt_;             // HaltWords; none where the device does not share the host's memory
  Halting halting_;
  bool lost_ = false;
  bool timed_by_host_ = false;
  bool seen_late_ = false;
  bool halted_at_once_ = false;
  std::int64_t gpu_ns_ = 0;
  query::ExecutorCallbacks* callbacks_ = nullptr;
};

}  // namespace rtstdb::accel
