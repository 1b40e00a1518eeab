// Images of modules as PNG files: read back with libpng they have the same pixels.

#include "runtime/run/image_files.hpp"

#include <gtest/gtest.h>
#include <png.h>

#include <cstring>
#include <string>
#include <vector>

#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

contribution::Image gradient(const std::string& name) {
  contribution::Image image{.name = name, .width = 40, .height = 30, .grey = {}};
  for (std::uint32_t y = 0; y < image.height; ++y) {
    for (std::uint32_t x = 0; x < image.width; ++x)
      image.grey.push_back(static_cast<std::uint8_t>(6 * x + y));
  }
  return image;
}

TEST(ImageFiles, HaveTheSamePixels) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path images = image_folder(folder.path());
  const contribution::Image image = gradient("a-1");
  EXPECT_TRUE(write_images(std::vector{image, gradient("b")}, images).empty());
  EXPECT_TRUE(std::filesystem::exists(images / "b.png"));
  png_image png;
  std::memset(&png, 0, sizeof png);
  png.version = PNG_IMAGE_VERSION;
  ASSERT_NE(png_image_begin_read_from_file(&png, (images / "a-1.png").c_str()), 0) << png.message;
  EXPECT_EQ(png.width, image.width);
  EXPECT_EQ(png.height, image.height);
  png.format = PNG_FORMAT_GRAY;
  std::vector<std::uint8_t> pixels(PNG_IMAGE_SIZE(png));
  ASSERT_NE(png_image_finish_read(&png, nullptr, pixels.data(), 0, nullptr), 0) << png.message;
  EXPECT_EQ(pixels, image.grey);
}

TEST(ImageFiles, NothingIsMadeWithoutImages) {
  const tests::TemporaryFolder folder;
  EXPECT_TRUE(write_images({}, image_folder(folder.path())).empty());
  EXPECT_FALSE(std::filesystem::exists(image_folder(folder.path())));
}

TEST(ImageFiles, ImageThatCanNotBeWrittenIsAFault) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path images = image_folder(folder.path());
  std::filesystem::create_directories(images / "a.png");
  const auto faults = write_images(std::vector{gradient("a"), gradient("b")}, images);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_NE(faults[0].find("a.png can not be written"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(images / "b.png"));
}

}  // namespace
}  // namespace hil::run
