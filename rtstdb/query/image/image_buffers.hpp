#pragma once
// The outputs of the images of a batch: host memory that the caller reads, with a buffer over each.

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include <rtstdb/image.hpp>

#include "rtstdb/query/gpu_query.hpp"
#include "shaders/shared/image.h"

namespace rtstdb::query {

class ImageBuffers {
 public:
  /// Allocates the chosen outputs of options.capacity images.
  explicit ImageBuffers(const ImageQueryOptions& options);

  void add_needs(DeviceNeeds& needs, const std::string& name);
  /// Sets where the outputs of an image lie on the device.
  void set_addresses(std::uint32_t image, shared::CameraRecord& camera) const noexcept;
  /// Sets the spans of an image.
  void set_spans(std::uint32_t image, Image& spans) const noexcept;
  /// Makes the rows from `first` to before `end` of an image visible to the host.
  void pull_rows(std::uint32_t image, std::uint32_t first, std::uint32_t end) const noexcept;
  /// Black, and nothing seen, in a tile that the device may have written in part.
  void clear_tile(std::uint32_t image, std::uint32_t tile) const noexcept;

 private:
  enum Output : std::uint8_t {
    color,
    srgb,
    depth,
    entities,
    triangles,
    materials,
    normals,
    motion,
    output_count
  };
  struct OutputBuffer {
    gpu::HostMemory memory;  // empty: the output is not chosen
    gpu::Buffer buffer;
  };

  template <class T>
  std::span<T> pixels(Output output, std::uint32_t image) const noexcept;
  glm::uvec2 address(Output output, std::uint32_t image) const noexcept;
  template <class T>
  void clear(Output output, std::uint32_t image, std::uint32_t tile, const T& value) const noexcept;

  std::uint32_t width_, height_;
  std::array<OutputBuffer, output_count> buffers_;
};

}  // namespace rtstdb::query
