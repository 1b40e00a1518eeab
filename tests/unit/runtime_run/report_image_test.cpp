// Images for the page: reduced, and as PNG files in base64.

#include "runtime/run/report_image.hpp"

#include <gtest/gtest.h>

#include "runtime/run/base64.hpp"

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

TEST(ReportImage, LargeImagesAreReducedByMeansOfLinearValues) {
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

}  // namespace
}  // namespace hil::run
