#pragma once
// One recorder and one timeline used in turn: record, run, wait.

#include <utility>

#include "rtstdb/gpu/device.hpp"
#include "rtstdb/query/executor.hpp"

namespace rtstdb::accel {

class Submit {
 public:
  static Result<Submit> create(gpu::Device& device);

  /// The recorder, begun.
  gpu::Recorder& recorder() noexcept { return recorder_; }
  void begin();
  /// From now on run() tells this about its waits; null: nobody.
  void while_waiting(query::Meanwhile* meanwhile) noexcept { meanwhile_ = meanwhile; }
  /// Ends the recorder, submits it and waits. False: the device is lost.
  bool run();
  /// Time that the device spent on all runs since the last call. A device that is the processor itself is timed
  /// by the host, from the submission until the wait is over: lavapipe draws a scene with all its threads for each
  /// timestamp, which takes longer than a small dispatch.
  std::int64_t take_gpu_ns() noexcept { return std::exchange(gpu_ns_, 0); }

 private:
  gpu::Recorder recorder_;
  gpu::Timeline timeline_;
  bool timed_by_host_ = false;
  std::int64_t gpu_ns_ = 0;
  query::Meanwhile* meanwhile_ = nullptr;
};

}  // namespace rtstdb::accel
