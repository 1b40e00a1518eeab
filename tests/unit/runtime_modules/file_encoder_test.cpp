// The files that cameras and scanners make of what the tick hands over.

#include <glm/gtc/packing.hpp>
#include <gtest/gtest.h>

#include <array>
#include <cstring>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "runtime/modules/camera/image_encoder.hpp"
#include "runtime/modules/laser_scanner/pcd_encoder.hpp"
#include "tests/support/pcd_reader.hpp"

namespace hil::modules {
namespace {

constexpr std::int64_t tick_ns = 1'000'000;

/// Keeps contents and samples in memory.
class KeptFiles final : public FileOutput {
 public:
  bool write(const std::string& name, std::span<const std::byte> content) override {
    contents[name] = {reinterpret_cast<const char*>(content.data()), content.size()};
    return !refused.contains(name);
  }
  bool write(const std::string& name, const PngImage& image) override {
    EXPECT_EQ(image.width, 4U);
    EXPECT_EQ(image.height, 2U);
    if (const auto* grey = std::get_if<PngImage::Grey16>(&image.pixels))
      samples[name] = {grey->samples.begin(), grey->samples.end()};
    if (const auto* rgb = std::get_if<PngImage::Rgb8>(&image.pixels))
      samples[name] = {rgb->samples.begin(), rgb->samples.end()};
    return !refused.contains(name);
  }
  std::map<std::string, std::string> contents;
  std::map<std::string, std::vector<std::uint16_t>> samples;
  std::set<std::string> refused;
};

ImageEncoderOptions images_of(const std::string& name) {
  return {.name = name, .width = 4, .height = 2, .has_images = true, .tick_ns = tick_ns};
}

rtstdb::SrgbColor color_of(std::int64_t tick, std::size_t pixel) {
  const auto sample = [&](std::int64_t channel) {
    return static_cast<std::uint8_t>(31 * tick + 7 * static_cast<std::int64_t>(pixel) + 101 * channel);
  };
  return {sample(0), sample(1), sample(2), 255};
}

void encode(ImageEncoder& encoder, std::int64_t tick, KeptFiles& files) {
  std::vector<std::byte> buffer(encoder.buffer_bytes());
  const ImageBuffer parts = encoder.parts_of(buffer);
  for (std::size_t i = 0; i < parts.srgb.size(); ++i)
    parts.srgb[i] = color_of(tick, i);
  encoder.encode(buffer, tick * tick_ns, files);
}

TEST(ImageEncoder, PixelsAreInAFileNamedByTheTick) {
  KeptFiles files;
  ImageEncoder front(images_of("front"));
  EXPECT_EQ(front.buffer_bytes(), 8 * sizeof(rtstdb::SrgbColor));
  encode(front, 40, files);
  encode(front, 1'234'567, files);
  ASSERT_EQ(files.samples.size(), 2U);
  for (const auto& [name, tick] : {std::pair{"camera-front-000040.png", std::int64_t{40}},
                                   std::pair{"camera-front-1234567.png", std::int64_t{1'234'567}}}) {
    const std::vector<std::uint16_t>& samples = files.samples.at(name);
    ASSERT_EQ(samples.size(), 24U);
    for (std::size_t i = 0; i < 24; ++i)
      EXPECT_EQ(samples[i], color_of(tick, i / 3)[i % 3]) << name << " " << i;
  }
}

TEST(ImageEncoder, TheLastImageIsTheLastOneInAFile) {
  KeptFiles files;
  files.refused = {"camera-front-000002.png"};
  ImageEncoder front(images_of("front"));
  EXPECT_TRUE(front.last_rgb().empty());
  encode(front, 1, files);
  encode(front, 2, files);
  ASSERT_EQ(front.last_rgb().size(), 24U);
  EXPECT_EQ(front.last_rgb()[23], color_of(1, 7)[2]);
  encode(front, 3, files);
  EXPECT_EQ(front.last_rgb()[23], color_of(3, 7)[2]);
}

TEST(ImageEncoder, DepthsAreUnitsOfTheStep) {
  ImageEncoderOptions options = images_of("front");
  options.has_images = false;
  options.depth_step_m = 0.01;
  ImageEncoder front(options);
  std::vector<std::byte> buffer(front.buffer_bytes());
  const ImageBuffer parts = front.parts_of(buffer);
  EXPECT_TRUE(parts.color.empty() && parts.srgb.empty());
  const std::vector<float> depth_m{
      std::numeric_limits<float>::infinity(), 0.001f, 1.0f, 1.006f, 12.34f, 655.34f, 655.35f, 9000.0f};
  ASSERT_EQ(parts.depth_m.size(), depth_m.size());
  std::ranges::copy(depth_m, parts.depth_m.begin());
  KeptFiles files;
  front.encode(buffer, 3 * tick_ns, files);
  ASSERT_EQ(files.samples.size(), 1U) << "no colour";
  EXPECT_EQ(files.samples.at("camera-front-000003-depth.png"),
            (std::vector<std::uint16_t>{0, 1, 100, 101, 1234, 65534, 65535, 65535}));
  EXPECT_TRUE(front.last_rgb().empty());
}

TEST(ImageEncoder, WithNoiseTheSensorMakesThePixels) {
  ImageEncoderOptions options = images_of("front");
  options.depth_step_m = 0.01;
  options.sensor = {.exposure_value = 3.0, .full_well_e = 500.0, .read_noise_e = 4.0, .noise_seed = 5};
  std::vector<rtstdb::HalfColor> color(8);
  for (std::size_t i = 0; i < color.size(); ++i)
    color[i].fill(glm::packHalf1x16(static_cast<float>(i)));
  std::vector<rtstdb::SrgbColor> expected(8);
  ImageSensor(options.sensor).develop(color, 2 * tick_ns, expected);
  ImageEncoder front(options);
  std::vector<std::byte> buffer(front.buffer_bytes());
  const ImageBuffer parts = front.parts_of(buffer);
  EXPECT_TRUE(parts.srgb.empty());
  EXPECT_EQ(parts.depth_m.size(), 8U);
  std::ranges::copy(color, parts.color.begin());
  KeptFiles files;
  front.encode(buffer, 2 * tick_ns, files);
  const std::vector<std::uint16_t>& samples = files.samples.at("camera-front-000002.png");
  ASSERT_EQ(samples.size(), 24U);
  for (std::size_t i = 0; i < 24; ++i)
    EXPECT_EQ(samples[i], expected[i / 3][i % 3]) << i;
}

CloudPoint point_of(std::uint32_t k) {
  const auto x = static_cast<float>(k);
  return {.x_m = x + 0.1f,
          .y_m = -x,
          .z_m = 1e-3f * x,
          .intensity_per_m2 = 1.0f / (1.0f + x),
          .fraction = 0.25f,
          .column = k / 7,
          .row = k % 7,
          .ordinal = k % 3,
          .entity = 1000 + k,
          .material = 4000 + k,
          .time_s = 12.3456789012 + 1e-9 * k};
}

TEST(PcdEncoder, PointsAreReadBackByAnotherProgram) {
  for (const std::uint32_t count : {100u, 0u}) {
    std::vector<std::byte> buffer(sizeof(CloudHead) + count * sizeof(CloudPoint));
    const CloudHead head{.number = 12 + count,
                         .sensor = {.p_world_m = {1.5, -2.25, 1e-7}, .q_world = {0.5, -0.5, 0.5, 0.5}}};
    std::memcpy(buffer.data(), &head, sizeof head);
    ASSERT_EQ(points_in(buffer).size(), count);
    for (std::uint32_t k = 0; k < count; ++k)
      points_in(buffer)[k] = point_of(k);
    KeptFiles files;
    PcdEncoder("lidar").encode(buffer, 0, files);
    ASSERT_EQ(files.contents.size(), 1U);
    const std::string name = count == 0 ? "lidar-000012.pcd" : "lidar-000112.pcd";
    const tests::PcdCloud cloud = tests::read_pcd(files.contents.at(name));
    ASSERT_EQ(cloud.points, count);
    EXPECT_EQ(cloud.viewpoint, (std::array{1.5, -2.25, 1e-7, 0.5, -0.5, 0.5, 0.5}));
    for (std::uint32_t k = 0; k < count; ++k) {
      const CloudPoint point = point_of(k);
      EXPECT_EQ(cloud["x"][k], static_cast<double>(point.x_m));
      EXPECT_EQ(cloud["y"][k], static_cast<double>(point.y_m));
      EXPECT_EQ(cloud["z"][k], static_cast<double>(point.z_m));
      EXPECT_EQ(cloud["intensity"][k], static_cast<double>(point.intensity_per_m2));
      EXPECT_EQ(cloud["fraction"][k], 0.25);
      EXPECT_EQ(cloud["column"][k], point.column);
      EXPECT_EQ(cloud["row"][k], point.row);
      EXPECT_EQ(cloud["return"][k], point.ordinal);
      EXPECT_EQ(cloud["entity"][k], point.entity);
      EXPECT_EQ(cloud["material"][k], point.material);
      EXPECT_EQ(cloud["time"][k], point.time_s);
    }
  }
}

}  // namespace
}  // namespace hil::modules
