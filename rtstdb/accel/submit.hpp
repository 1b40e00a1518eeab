#pragma once
// A recorder and a timeline used in turn: record, start, finish. Several may be in flight; the device
// executes them in the order in which they were started.
//
// Threads: one at a time.

#include <glm/vec2.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <utility>

#include "rtstdb/gpu/device.hpp"

namespace rtstdb::accel {

/// When a submission may be halted: the device then starts no further elements of it.
struct HaltOptions {
  std::chrono::nanoseconds halt_after{0};  ///< device time after which it may be halted; zero: never
  bool early = false;                      ///< finish(awaited = true) may halt it before that
};

/// What a Submit calls around its waits for the device, on the thread that waits.
class WaitCallbacks {
 public:
  virtual ~WaitCallbacks() = default;
  virtual void begin_wait() noexcept = 0;
  virtual void end_wait() noexcept = 0;
  /// Called between begin_wait and end_wait. True: the submission should be halted when HaltOptions allow it.
  virtual bool halt_requested() noexcept = 0;
};

class Submit {
 public:
  /// The last time at which the host saw the device idle. A submission that the host times begins no earlier.
  using DeviceIdle = std::chrono::steady_clock::time_point;

  /// Submissions that may be in flight together share `device_idle`.
  static Result<Submit> create(gpu::Device& device,
                               std::shared_ptr<DeviceIdle> device_idle = std::make_shared<DeviceIdle>());

  /// Begins the recorder.
  void begin();
  /// The recorder, to be filled between begin and start.
  gpu::Recorder& recorder() noexcept { return recorder_; }
  /// finish() calls these around its waits from now on; null: none.
  void set_wait_callbacks(WaitCallbacks* callbacks) noexcept { callbacks_ = callbacks; }
  /// Ends the recorder and submits it. False: the device is lost.
  bool start(const HaltOptions& halt = {});
  /// Waits for the started submission; a second call returns the same. False: the device is lost. The
  /// submission is halted as its HaltOptions allow when `awaited` (its end is waited for by a preempting run)
  /// or WaitCallbacks::halt_requested say so, and with it `next`, which was started after it and may be null.
  bool finish(bool awaited = false, Submit* next = nullptr);
  bool run() { return start() && finish(); }

  /// Address of the HaltWords for dispatches that can be halted (shaders/common/halt.glsl). Zero on a device
  /// that does not share the host's memory: nothing is halted there.
  glm::uvec2 halt_address() const noexcept { return halt_ ? halt_.address() : glm::uvec2(0); }
  /// Of the submission that was finished last: its first element that did not start because of a halt;
  /// without one, the largest number.
  std::uint32_t first_unstarted() const noexcept;
  /// The submission that was finished last was halted before its halt_after.
  bool halted_early() const noexcept { return halted_early_; }
  /// Of a device that the host times: the submission that was finished last had completed before finish was
  /// called, and took less than was measured.
  bool completed_before_wait() const noexcept { return completed_before_wait_; }
  /// Device time of all submissions since the last call. The host times a software device, from the start
  /// until the end of the wait: there a timestamp takes longer than a small dispatch.
  std::int64_t take_gpu_ns() noexcept { return std::exchange(gpu_ns_, 0); }

 private:
  gpu::WaitResult wait(bool awaited, Submit* next);
  void halt() noexcept;

  gpu::Recorder recorder_;
  gpu::Timeline timeline_;
  std::shared_ptr<DeviceIdle> device_idle_;
  DeviceIdle started_;
  std::uint64_t in_flight_ = 0;  ///< its number on the timeline; 0: none
  gpu::Buffer halt_;             ///< HaltWords; none where the device does not share the host's memory
  HaltOptions halt_options_;
  bool lost_ = false;
  bool timed_by_host_ = false;
  bool completed_before_wait_ = false;
  bool halted_early_ = false;
  std::int64_t gpu_ns_ = 0;
  WaitCallbacks* callbacks_ = nullptr;
};

}  // namespace rtstdb::accel
