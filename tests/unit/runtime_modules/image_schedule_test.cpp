#include "runtime/modules/camera/image_schedule.hpp"

#include <gtest/gtest.h>

#include <vector>

namespace hil::modules {
namespace {

constexpr std::int64_t millisecond = 1'000'000;

std::vector<std::uint64_t> releases_with_an_image(const ImageSchedule& schedule, std::uint64_t end) {
  std::vector<std::uint64_t> releases;
  for (std::uint64_t release = 0; release < end; ++release)
    if (schedule.image_of(release)) releases.push_back(release);
  return releases;
}

TEST(ImageSchedule, WithoutARateEachReleaseTakesAnImage) {
  const ImageSchedule schedule(0.0, 10 * millisecond);
  EXPECT_TRUE(schedule.is_even());
  for (std::uint64_t release = 0; release < 5; ++release)
    EXPECT_EQ(schedule.image_of(release), release);
}

TEST(ImageSchedule, AWholeNumberOfReleasesIsEven) {
  const ImageSchedule schedule(25.0, 10 * millisecond);
  EXPECT_TRUE(schedule.is_even());
  EXPECT_EQ(releases_with_an_image(schedule, 13), (std::vector<std::uint64_t>{0, 4, 8, 12}));
  EXPECT_EQ(schedule.image_of(8), 2U);
}

TEST(ImageSchedule, OtherImagesAreAtTheNearestRelease) {
  const ImageSchedule schedule(30.0, 10 * millisecond);
  EXPECT_FALSE(schedule.is_even());
  // 0, 33.3, 66.7, 100, 133.3, 166.7 and 200 ms
  EXPECT_EQ(releases_with_an_image(schedule, 21), (std::vector<std::uint64_t>{0, 3, 7, 10, 13, 17, 20}));
  std::uint64_t images = 0;
  for (std::uint64_t release = 0; release < 360'000; ++release) {
    const auto image = schedule.image_of(release);
    if (!image) continue;
    ASSERT_EQ(*image, images++) << "each image has one release";
  }
  EXPECT_EQ(images, 108'000U) << "an hour has 30 images in each second";
}

TEST(ImageSchedule, ARoundedRateStaysEven) {
  const ImageSchedule schedule(100.0 / 3.0, 10 * millisecond);
  EXPECT_TRUE(schedule.is_even());
  EXPECT_EQ(schedule.image_of(3'000'000'000U), 1'000'000'000U);
  EXPECT_FALSE(schedule.image_of(3'000'000'001U));
}

}  // namespace
}  // namespace hil::modules
