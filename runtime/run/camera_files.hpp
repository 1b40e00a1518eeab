#pragma once
// The images of cameras, as files in the folder images of a run:
//     camera-<module>-<tick>.png        colour, 8 bits of sRGB
//     camera-<module>-<tick>-depth.png  depth along the view direction, 16 bits, in units of depth_step_m;
//                                       0: nothing is seen; 65535: at least 65535 units
// The number of the tick has at least six digits.
//
// The tick copies images into preallocated buffers; an ordinary thread applies the noise of the sensor and
// writes the files. If all buffers of a camera wait for the disk, its next image is dropped and counted;
// under the virtual clock the tick waits for a buffer instead. No file is begun once the files of a camera
// have CameraStreamOptions::max_bytes.
//
// Threads: open and close at setup and after the last tick; the streams in the tick.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "runtime/modules/camera_images.hpp"

namespace hil::run {

/// What became of the images of a camera.
struct CameraFileRecord {
  std::string name{};              ///< of the module
  std::uint64_t dropped = 0;       ///< the disk was too slow
  std::uint64_t beyond_limit = 0;  ///< not written, since the files had max_bytes
  std::uint64_t max_bytes = 0;
  std::uint64_t failed = 0;                    ///< files that could not be written
  std::string first_fault{};                   ///< of those, a sentence
  std::string last_file{};                     ///< in the folder of the run; empty: none was written
  std::optional<std::int64_t> last_time_ns{};  ///< of its image
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint8_t> last_rgb{};  ///< the last image, sRGB; empty: none
};

class CameraFiles final : public modules::CameraImageSink {
 public:
  /// `tick_ns`: the period of the base rate.
  CameraFiles(const std::filesystem::path& run_folder, bool virtual_clock, std::int64_t tick_ns);
  ~CameraFiles() override;
  CameraFiles(const CameraFiles&) = delete;
  CameraFiles& operator=(const CameraFiles&) = delete;

  /// Throws io::DeviceError if the folder can not be created. A stream may outlive this object; images that
  /// it hands over later are lost.
  std::unique_ptr<modules::CameraImageStream> open(const modules::CameraStreamOptions& options) override;
  /// Writes the remaining images. The records of all streams, in the order of open(). Later calls return
  /// none.
  std::vector<CameraFileRecord> close();

 private:
  class Buffers;
  class Stream;
  void serve();

  const std::filesystem::path folder_;
  const bool virtual_clock_;
  const std::int64_t tick_ns_;
  std::vector<std::shared_ptr<Buffers>> streams_;  // constant while the thread runs
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace hil::run
