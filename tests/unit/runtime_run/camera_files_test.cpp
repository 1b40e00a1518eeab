#include "runtime/run/camera_files.hpp"

#include <glm/gtc/packing.hpp>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <limits>

#include "tests/support/allocation_guard.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/png_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

using modules::CameraImageStream;
using modules::CameraStreamOptions;
using tests::PngContent;
using tests::read_png;
using tests::TemporaryFolder;

constexpr std::int64_t millisecond = 1'000'000;
constexpr std::uint64_t no_limit = std::numeric_limits<std::uint64_t>::max();

CameraStreamOptions images_of(const char* name) {
  return {.name = name, .width = 4, .height = 2, .has_images = true, .max_bytes = no_limit};
}

std::uint8_t sample_of(std::int64_t tick, std::size_t pixel, std::size_t channel) {
  return static_cast<std::uint8_t>(31 * tick + 7 * static_cast<std::int64_t>(pixel) +
                                   101 * static_cast<std::int64_t>(channel));
}

/// Hands over the image of a tick; false: it is dropped.
bool send(CameraImageStream& stream, std::int64_t tick) {
  const auto frame = stream.begin();
  if (!frame) return false;
  for (std::size_t i = 0; i < frame->srgb.size(); ++i)
    frame->srgb[i] = {sample_of(tick, i, 0), sample_of(tick, i, 1), sample_of(tick, i, 2), 255};
  stream.finish(tick * millisecond);
  return true;
}

void expect_image(const PngContent& png, std::int64_t tick) {
  ASSERT_EQ(png.width, 4U) << tick;
  ASSERT_EQ(png.height, 2U);
  ASSERT_EQ(png.bits, 8);
  ASSERT_EQ(png.channels, 3);
  for (std::size_t i = 0; i < 8; ++i)
    for (std::size_t channel = 0; channel < 3; ++channel)
      EXPECT_EQ(png.samples[3 * i + channel], sample_of(tick, i, channel)) << tick << " " << i;
}

TEST(CameraFiles, AreReadBackFromPngFiles) {
  for (const bool virtual_clock : {true, false}) {
    const TemporaryFolder folder;
    CameraFiles files(folder.path(), virtual_clock, millisecond);
    const auto front = files.open(images_of("front"));
    const auto rear = files.open(images_of("rear"));
    ASSERT_TRUE(send(*front, 0));
    ASSERT_TRUE(send(*front, 40));
    ASSERT_TRUE(send(*rear, 1'234'567));
    const std::vector<CameraFileRecord> records = files.close();
    expect_image(read_png(folder.path() / "images/camera-front-000000.png"), 0);
    expect_image(read_png(folder.path() / "images/camera-front-000040.png"), 40);
    expect_image(read_png(folder.path() / "images/camera-rear-1234567.png"), 1'234'567);
    ASSERT_EQ(records.size(), 2U);
    EXPECT_EQ(records[0].name, "front");
    EXPECT_EQ(records[0].last_file, "images/camera-front-000040.png");
    EXPECT_EQ(records[0].last_time_ns, 40 * millisecond);
    EXPECT_EQ(records[0].dropped + records[0].failed + records[0].beyond_limit, 0U);
    ASSERT_EQ(records[0].last_rgb.size(), 24U);
    EXPECT_EQ(records[0].last_rgb[23], sample_of(40, 7, 2));
    EXPECT_FALSE(send(*rear, 9)) << "the files are closed";
    EXPECT_TRUE(files.close().empty());
  }
}

TEST(CameraFiles, DepthsAreUnitsOfTheStep) {
  const TemporaryFolder folder;
  CameraFiles files(folder.path(), true, millisecond);
  CameraStreamOptions options = images_of("front");
  options.has_images = false;
  options.depth_step_m = 0.01;
  const auto front = files.open(options);
  const auto frame = front->begin();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->color.empty() && frame->srgb.empty());
  const std::vector<float> depth_m{
      std::numeric_limits<float>::infinity(), 0.001f, 1.0f, 1.006f, 12.34f, 655.34f, 655.35f, 9000.0f};
  ASSERT_EQ(frame->depth_m.size(), depth_m.size());
  std::ranges::copy(depth_m, frame->depth_m.begin());
  front->finish(3 * millisecond);
  const auto records = files.close();
  const PngContent png = read_png(folder.path() / "images/camera-front-000003-depth.png");
  EXPECT_EQ(png.bits, 16);
  EXPECT_EQ(png.channels, 1);
  EXPECT_EQ(png.samples, (std::vector<std::uint16_t>{0, 1, 100, 101, 1234, 65534, 65535, 65535}));
  EXPECT_EQ(records[0].last_file, "images/camera-front-000003-depth.png");
  EXPECT_TRUE(records[0].last_rgb.empty());
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "images/camera-front-000003.png"));
}

TEST(CameraFiles, WithNoiseTheSensorMakesThePixels) {
  CameraStreamOptions options = images_of("front");
  options.sensor = {.exposure_value = 3.0, .full_well_e = 500.0, .read_noise_e = 4.0, .noise_seed = 5};
  std::vector<rtstdb::HalfColor> color(8);
  for (std::size_t i = 0; i < color.size(); ++i)
    color[i].fill(glm::packHalf1x16(static_cast<float>(i)));
  std::vector<rtstdb::SrgbColor> expected(8);
  modules::ImageSensor(options.sensor).develop(color, 2 * millisecond, expected);
  const TemporaryFolder folder;
  CameraFiles files(folder.path(), false, millisecond);
  const auto front = files.open(options);
  const auto frame = front->begin();
  ASSERT_TRUE(frame);
  EXPECT_TRUE(frame->srgb.empty());
  std::ranges::copy(color, frame->color.begin());
  front->finish(2 * millisecond);
  files.close();
  const PngContent png = read_png(folder.path() / "images/camera-front-000002.png");
  ASSERT_EQ(png.samples.size(), 24U);
  for (std::size_t i = 0; i < 24; ++i)
    EXPECT_EQ(png.samples[i], expected[i / 3][i % 3]) << i;
}

TEST(CameraFiles, AreNotCreatedWithoutAStream) {
  const TemporaryFolder folder;
  CameraFiles files(folder.path(), false, millisecond);
  EXPECT_TRUE(files.close().empty());
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "images"));
}

TEST(CameraFiles, UnderTheVirtualClockNoneIsDropped) {
  const TemporaryFolder folder;
  CameraFiles files(folder.path(), true, millisecond);
  const auto front = files.open(images_of("front"));
  for (int tick = 0; tick < 50; ++tick)
    ASSERT_TRUE(send(*front, tick)) << tick;
  EXPECT_EQ(files.close()[0].dropped, 0U);
  for (int tick = 0; tick < 50; ++tick) {
    char name[32];
    std::snprintf(name, sizeof name, "camera-front-%06d.png", tick);
    expect_image(read_png(folder.path() / "images" / name), tick);
  }
}

// The first file is a pipe, which blocks the writing thread until the test reads it.
TEST(CameraFiles, ImagesThatTheDiskIsTooSlowForAreCounted) {
  const TemporaryFolder folder;
  CameraFiles files(folder.path(), false, millisecond);
  const auto front = files.open(images_of("front"));
  const std::filesystem::path pipe = folder.path() / "images/camera-front-000000.png";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  int sent = 0;
  allocation_guard::reset();
  allocation_guard::enter_tick();
  while (send(*front, sent))
    ++sent;
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_EQ(sent, 3) << "the buffers of a camera";
  expect_image(read_png(pipe), 0);
  ASSERT_TRUE(tests::eventually([&] { return send(*front, 99); }));
  const std::vector<CameraFileRecord> records = files.close();
  EXPECT_GE(records[0].dropped, 1U);
  expect_image(read_png(folder.path() / "images/camera-front-000002.png"), 2);
  expect_image(read_png(folder.path() / "images/camera-front-000099.png"), 99);
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "images/camera-front-000003.png"))
      << "the dropped one";
}

TEST(CameraFiles, EndAtTheirLargestSize) {
  const TemporaryFolder folder;
  CameraFiles files(folder.path(), true, millisecond);
  CameraStreamOptions options = images_of("front");
  options.max_bytes = 1;
  const auto front = files.open(options);
  for (int tick = 0; tick < 5; ++tick)
    ASSERT_TRUE(send(*front, tick));
  const CameraFileRecord record = files.close()[0];
  EXPECT_EQ(record.beyond_limit, 4U);
  EXPECT_EQ(record.last_file, "images/camera-front-000000.png");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "images/camera-front-000001.png"));
}

TEST(CameraFiles, FileThatCanNotBeWrittenIsReported) {
  const TemporaryFolder folder;
  CameraFiles files(folder.path(), true, millisecond);
  const auto front = files.open(images_of("front"));
  std::filesystem::create_directory(folder.path() / "images/camera-front-000001.png");
  ASSERT_TRUE(send(*front, 0));
  ASSERT_TRUE(send(*front, 1));
  const CameraFileRecord record = files.close()[0];
  EXPECT_EQ(record.failed, 1U);
  EXPECT_NE(record.first_fault.find("camera-front-000001.png can not be written"), std::string::npos);
  EXPECT_EQ(record.last_file, "images/camera-front-000000.png");
  EXPECT_EQ(record.last_rgb[0], sample_of(0, 0, 0)) << "the last image that is in a file";
}

}  // namespace
}  // namespace hil::run
