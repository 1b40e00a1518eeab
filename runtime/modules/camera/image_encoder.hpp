#pragma once
// The images of a camera, as files in the folder images of a run:
//     camera-<module>-<tick>.png        colour, 8 bits of sRGB
//     camera-<module>-<tick>-depth.png  depth along the view direction, 16 bits, in units of depth_step_m;
//                                       0: nothing is seen; 65535: at least 65535 units
// The number of the tick has at least six digits. The tick copies an image into a buffer; the encoder applies
// the noise of the sensor.
//
// Threads: as hil/file_stream.hpp; last_rgb after the last tick.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <hil/file_stream.hpp>
#include <rtstdb/image.hpp>

#include "runtime/modules/camera/image_sensor.hpp"

namespace hil::modules {

struct ImageEncoderOptions {
  std::string name{};  ///< of the module
  std::uint32_t width = 0, height = 0;
  bool has_images = false;    ///< colour
  double depth_step_m = 0.0;  ///< 0: no files of depths
  SensorOptions sensor{};
  std::int64_t tick_ns = 0;  ///< the period of the base rate
};

/// The parts of a buffer: each span has width * height elements or none.
struct ImageBuffer {
  std::span<rtstdb::HalfColor> color{};  ///< of images with noise
  std::span<rtstdb::SrgbColor> srgb{};   ///< of images without noise
  std::span<float> depth_m{};            ///< infinite where nothing is seen
};

class ImageEncoder final : public FileEncoder {
 public:
  explicit ImageEncoder(const ImageEncoderOptions& options);

  std::size_t buffer_bytes() const noexcept;
  ImageBuffer parts_of(std::span<std::byte> buffer) const noexcept;
  void encode(std::span<std::byte> buffer, std::int64_t time_ns, FileOutput& files) override;
  /// The last image that is in a file: red, green, blue; empty: none.
  const std::vector<std::uint8_t>& last_rgb() const noexcept { return last_rgb_; }

 private:
  const ImageEncoderOptions options_;
  const ImageSensor sensor_;
  const std::size_t pixels_;
  std::vector<rtstdb::SrgbColor> developed_;  // of an image with noise
  std::vector<std::uint8_t> rgb_, last_rgb_;
};

/// Depths as samples of a grey image, in units of `step_m`: 0 for an infinite depth, 65535 for this depth or
/// more.
std::vector<std::uint16_t> depth_samples(std::span<const float> depth_m, double step_m);

}  // namespace hil::modules
