// Images and files of modules: PNG files read back with libpng have the same pixels.

#include "runtime/run/contributed_files.hpp"

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

contribution::Contribution of_images(std::vector<contribution::Image> images) {
  contribution::Contribution report;
  report.images = std::move(images);
  return report;
}

contribution::Contribution of_files(std::vector<contribution::File> files) {
  contribution::Contribution report;
  report.files = std::move(files);
  return report;
}

TEST(ContributedFiles, HaveTheSamePixels) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path images = image_folder(folder.path());
  const contribution::Image image = gradient("a-1");
  EXPECT_TRUE(write_files(of_images({image, gradient("b")}), folder.path()).empty());
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

TEST(ContributedFiles, NothingIsMadeWithoutFiles) {
  const tests::TemporaryFolder folder;
  EXPECT_TRUE(write_files({}, folder.path()).empty());
  EXPECT_FALSE(std::filesystem::exists(image_folder(folder.path())));
  EXPECT_FALSE(std::filesystem::exists(other_folder(folder.path())));
}

TEST(ContributedFiles, HaveTheirContent) {
  const tests::TemporaryFolder folder;
  const std::string content = std::string("a,b\n1,2\n") + '\0' + "end";
  EXPECT_TRUE(write_files(of_files({{"table.csv", content}}), folder.path()).empty());
  EXPECT_EQ(folder.read("files/table.csv"), content);
  std::filesystem::create_directories(other_folder(folder.path()) / "x");
  const auto faults = write_files(of_files({{"x", ""}, {"y", "1"}}), folder.path());
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_NE(faults[0].find("files/x can not be written"), std::string::npos) << faults[0];
  EXPECT_EQ(folder.read("files/y"), "1");
}

TEST(ContributedFiles, ImageThatCanNotBeWrittenIsAFault) {
  const tests::TemporaryFolder folder;
  const std::filesystem::path images = image_folder(folder.path());
  std::filesystem::create_directories(images / "a.png");
  const auto faults = write_files(of_images({gradient("a"), gradient("b")}), folder.path());
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_NE(faults[0].find("a.png can not be written"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(images / "b.png"));
}

}  // namespace
}  // namespace hil::run
