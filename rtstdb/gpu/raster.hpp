#pragma once
// The rasteriser: draws triangles that a vertex shader reads from buffers. Depth is reversed: 1 is the near
// plane, 0 is infinitely far, and the largest depth of a pixel wins; of equal depths the triangle that was
// drawn first.
//
// Threads and loss of the device: as for the classes of device.hpp.

#include <cstdint>
#include <memory>
#include <string>

namespace rtstdb::gpu {

struct RasterTargetOptions {
  std::string name;  ///< for validation messages and frame captures
  std::uint32_t width = 0, height = 0;
  bool words = true;  ///< two words for each pixel, which the fragment shader writes; false: depth alone
};

/// What a draw fills: for each pixel two words (all bits set where nothing was drawn) and a depth.
class RasterTarget {
 public:
  RasterTarget();
  ~RasterTarget();
  RasterTarget(RasterTarget&&) noexcept;
  RasterTarget& operator=(RasterTarget&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::unique_ptr<Impl> impl_;
};

/// What becomes of the parts of triangles whose depth is above 1 or below 0.
enum class BeyondDepth : std::uint8_t {
  clipped,  ///< not drawn
  clamped,  ///< drawn with the depth 1 or 0
};

/// A vertex shader, and a fragment shader for targets with words.
class RasterPipeline {
 public:
  RasterPipeline();
  ~RasterPipeline();
  RasterPipeline(RasterPipeline&&) noexcept;
  RasterPipeline& operator=(RasterPipeline&&) noexcept;
  explicit operator bool() const noexcept { return impl_ != nullptr; }
  struct Impl;

 private:
  friend class Device;
  friend class Recorder;
  std::unique_ptr<Impl> impl_;
};

/// A draw, as the device reads it from a buffer with BufferOptions::indirect.
struct DrawCommand {
  std::uint32_t vertices = 0;
  std::uint32_t instances = 0;  ///< 0: nothing is drawn
  std::uint32_t first_vertex = 0;
  std::uint32_t first_instance = 0;
};

}  // namespace rtstdb::gpu
