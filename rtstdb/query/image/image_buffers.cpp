#include "rtstdb/query/image/image_buffers.hpp"

#include <algorithm>
#include <limits>

#include <rtstdb/limits.hpp>

namespace rtstdb::query {
namespace {

constexpr std::array<std::size_t, 8> bytes_per_pixel{
    sizeof(HalfColor),     sizeof(SrgbColor),  sizeof(float),     sizeof(EntityId),
    sizeof(std::uint32_t), sizeof(MaterialId), sizeof(glm::vec3), sizeof(glm::vec2)};
constexpr std::array<const char*, 8> output_names{" colour",    " sRGB",      " depth",   " entities",
                                                  " triangles", " materials", " normals", " motion"};

std::array<bool, 8> chosen(const ImageOutputs& o) noexcept {
  return {o.color, o.srgb, o.depth, o.identity, o.identity, o.identity, o.normal, o.motion};
}

}  // namespace

ImageBuffers::ImageBuffers(const ImageQueryOptions& options)
    : width_(options.width), height_(options.height) {
  const std::size_t pixels = std::size_t{options.capacity} * width_ * height_;
  for (std::uint8_t k = 0; k < output_count; ++k)
    if (chosen(options.outputs)[k]) buffers_[k].memory = gpu::HostMemory(pixels * bytes_per_pixel[k]);
}

void ImageBuffers::add_needs(DeviceNeeds& needs, const std::string& name) {
  for (std::uint8_t k = 0; k < output_count; ++k) {
    if (buffers_[k].memory.size_bytes() == 0) continue;
    needs.buffers.push_back({&buffers_[k].buffer,
                             {.name = name + output_names[k],
                              .size_bytes = buffers_[k].memory.size_bytes(),
                              .memory = gpu::Memory::readback,
                              .addressed = true,
                              .host = &buffers_[k].memory}});
  }
}

glm::uvec2 ImageBuffers::address(Output output, std::uint32_t image) const noexcept {
  const OutputBuffer& chosen = buffers_[output];
  if (chosen.memory.size_bytes() == 0) return glm::uvec2(0);
  return chosen.buffer.address(std::size_t{image} * width_ * height_ * bytes_per_pixel[output]);
}

void ImageBuffers::set_addresses(std::uint32_t image, shared::CameraRecord& camera) const noexcept {
  camera.color = address(color, image);
  camera.srgb = address(srgb, image);
  camera.depth = address(depth, image);
  camera.entities = address(entities, image);
  camera.triangles = address(triangles, image);
  camera.materials = address(materials, image);
  camera.normals = address(normals, image);
  camera.motion = address(motion, image);
}

template <class T>
std::span<T> ImageBuffers::pixels(Output output, std::uint32_t image) const noexcept {
  const auto all = buffers_[output].memory.as<T>();
  if (all.empty()) return {};
  const std::size_t count = std::size_t{width_} * height_;
  return all.subspan(image * count, count);
}

void ImageBuffers::set_spans(std::uint32_t image, Image& spans) const noexcept {
  spans.width = width_;
  spans.height = height_;
  spans.color = pixels<const HalfColor>(color, image);
  spans.srgb = pixels<const SrgbColor>(srgb, image);
  spans.depth_m = pixels<const float>(depth, image);
  spans.entities = pixels<const EntityId>(entities, image);
  spans.triangles = pixels<const std::uint32_t>(triangles, image);
  spans.materials = pixels<const MaterialId>(materials, image);
  spans.normals = pixels<const glm::vec3>(normals, image);
  spans.motion_px_s = pixels<const glm::vec2>(motion, image);
}

void ImageBuffers::pull_rows(std::uint32_t image, std::uint32_t first, std::uint32_t end) const noexcept {
  const std::size_t first_pixel = (std::size_t{image} * height_ + first) * width_;
  const std::size_t count = std::size_t{end - first} * width_;
  for (std::uint8_t k = 0; k < output_count; ++k) {
    if (buffers_[k].memory.size_bytes() != 0)
      buffers_[k].buffer.invalidate(first_pixel * bytes_per_pixel[k], count * bytes_per_pixel[k]);
  }
}

template <class T>
void ImageBuffers::clear(Output output, std::uint32_t image, std::uint32_t tile,
                         const T& value) const noexcept {
  const auto of_image = pixels<T>(output, image);
  if (of_image.empty()) return;
  const std::uint32_t across = (width_ + image_tile_px - 1) / image_tile_px;
  const std::uint32_t column = tile % across * image_tile_px;
  const std::uint32_t row = tile / across * image_tile_px;
  const std::uint32_t count = std::min(image_tile_px, width_ - column);
  for (std::uint32_t y = row; y < std::min(row + image_tile_px, height_); ++y)
    std::ranges::fill(of_image.subspan(std::size_t{y} * width_ + column, count), value);
}

void ImageBuffers::clear_tile(std::uint32_t image, std::uint32_t tile) const noexcept {
  constexpr std::uint16_t half_one = 0x3C00;
  clear(color, image, tile, HalfColor{0, 0, 0, half_one});
  clear(srgb, image, tile, SrgbColor{0, 0, 0, 255});
  clear(depth, image, tile, std::numeric_limits<float>::infinity());
  clear(entities, image, tile, EntityId{});
  clear(triangles, image, tile, std::uint32_t{0});
  clear(materials, image, tile, MaterialId{});
  clear(normals, image, tile, glm::vec3(0.0f));
  clear(motion, image, tile, glm::vec2(0.0f));
}

}  // namespace rtstdb::query
