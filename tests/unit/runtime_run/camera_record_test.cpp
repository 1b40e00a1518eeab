// The cameras in the record of a run: counts, sentences, and the last image in base64.

#include "runtime/run/camera_record.hpp"

#include <gtest/gtest.h>

#include "runtime/run/base64.hpp"
#include "runtime/run/png_file.hpp"
#include "runtime/run/report_image.hpp"

namespace hil::run {
namespace {

// The examples of RFC 4648, section 10.
TEST(Base64, PadsToFourLetters) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64(std::string("\xfb\xff\x00", 3)), "+/8A");
}

TEST(CameraRecord, LargeImagesAreReducedByMeansOfLinearValues) {
  // Four columns and three rows, one channel: squares of two become one, those at the border are smaller.
  const std::vector<std::uint8_t> greys{0, 255, 9, 9, 255, 0, 9, 9, 100, 100, 0, 255};
  std::vector<std::uint8_t> rgb;
  for (const std::uint8_t grey : greys)
    rgb.insert(rgb.end(), {grey, grey, grey});
  const SmallImage same = reduced(4, 3, rgb, 12);
  EXPECT_EQ(same.width, 4U);
  EXPECT_EQ(same.rgb, rgb);
  const SmallImage small = reduced(4, 3, rgb, 11);
  EXPECT_EQ(small.width, 2U);
  EXPECT_EQ(small.height, 2U);
  ASSERT_EQ(small.rgb.size(), 12U);
  EXPECT_EQ(small.rgb[0], 188) << "half of the light";
  EXPECT_EQ(small.rgb[3], 9);
  EXPECT_EQ(small.rgb[6], 100);
  EXPECT_EQ(small.rgb[9], 188);
}

TEST(CameraRecord, HasCountsFilesAndTheLastImage) {
  const std::vector<contribution::Camera> cameras{
      {.name = "front", .images = 9, .missing_tiles = 2, .exposure_value = 11.5},
      {.name = "list", .images = 8}};
  const std::vector<std::uint8_t> rgb{255, 0, 0, 0, 255, 0};
  const std::vector<CameraFileRecord> files{{.name = "front",
                                             .dropped = 1,
                                             .beyond_limit = 3,
                                             .max_bytes = 2'000'000,
                                             .failed = 2,
                                             .first_fault = "x.png can not be written: full",
                                             .last_file = "images/camera-front-000020.png",
                                             .last_time_ns = 20'000'000,
                                             .width = 2,
                                             .height = 1,
                                             .last_rgb = rgb}};
  report::RunRecord record;
  record.period_ns = 1'000'000;
  add_cameras(cameras, files, record);
  ASSERT_EQ(record.cameras.size(), 2U);
  const report::Camera& front = record.cameras[0];
  EXPECT_EQ(front.name, "front");
  EXPECT_EQ(front.images, 9U);
  EXPECT_EQ(front.dropped, 1U);
  EXPECT_EQ(front.beyond_limit, 3U);
  EXPECT_EQ(front.missing_tiles, 2U);
  EXPECT_EQ(front.exposure_value, 11.5);
  EXPECT_EQ(front.last_tick, 20U);
  EXPECT_EQ(front.last_image_png,
            base64(png_bytes({.width = 2, .height = 1, .pixels = PngImage::Rgb8{rgb}})));
  EXPECT_TRUE(record.cameras[1].last_file.empty());
  EXPECT_FALSE(record.cameras[1].last_tick);
  EXPECT_EQ(record.failures,
            (std::vector<std::string>{
                "1 image of camera front is not in a file: the disk was too slow",
                "2 files of camera front could not be written; the first: x.png can not be written: full"}));
  ASSERT_EQ(record.realtime.degraded.size(), 1U);
  EXPECT_EQ(record.realtime.degraded[0],
            "the files of camera front reached 2.00 MB ('max_size'); 3 images after that are not in files");
}

}  // namespace
}  // namespace hil::run
