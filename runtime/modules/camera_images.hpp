#pragma once
// The port through which cameras hand images to the run, which writes them as files. Modules know no file
// format and no thread.
//
// Rows of pixels begin at the top left. Times are run time.
// Threads: open at setup; begin and finish in the tick, where they do not allocate. In real time they do not
// block; under the virtual clock begin waits for the disk.

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <rtstdb/image.hpp>

#include "runtime/modules/camera/image_sensor.hpp"

namespace hil::modules {

struct CameraStreamOptions {
  std::string name{};  ///< of the module, for the names of files
  std::uint32_t width = 0, height = 0;
  bool has_images = false;  ///< colour
  /// A file holds depths as multiples of this; 0: no files of depths.
  double depth_step_m = 0.0;
  SensorOptions sensor{};
  /// No file is begun once the files of the stream have this size.
  std::uint64_t max_bytes = 0;
};

/// Memory for one image: each span has width * height elements or none.
struct CameraFrame {
  std::span<rtstdb::HalfColor> color{};  ///< of images with noise
  std::span<rtstdb::SrgbColor> srgb{};   ///< of images without noise
  std::span<float> depth_m{};            ///< infinite where nothing is seen
};

class CameraImageStream {
 public:
  virtual ~CameraImageStream() = default;
  /// Memory for the next image. Empty: all buffers wait for the disk, and the image is counted as dropped.
  virtual std::optional<CameraFrame> begin() noexcept = 0;
  /// Hands over the image that was exposed from time_ns on. Only after a begin() that was not empty.
  virtual void finish(std::int64_t time_ns) noexcept = 0;
};

class CameraImageSink {
 public:
  virtual ~CameraImageSink() = default;
  /// Images that a stream hands over after the end of the sink are lost.
  virtual std::unique_ptr<CameraImageStream> open(const CameraStreamOptions& options) = 0;
};

}  // namespace hil::modules
