// Files that modules write while a run goes on.

#include "runtime/run/file_streams.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <string>

#include "tests/support/allocation_guard.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/png_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

using modules::FileStream;
using modules::FileStreamOptions;
using modules::FileStreamRecord;
using tests::TemporaryFolder;

constexpr std::size_t buffer_bytes = 4096;

/// A file NAME-TIME with the content of the buffer.
class Copying final : public modules::FileEncoder {
 public:
  explicit Copying(std::string name) : name_(std::move(name)) {}
  void encode(std::span<std::byte> buffer, std::int64_t time_ns, modules::FileOutput& files) override {
    files.write(name_ + "-" + std::to_string(time_ns), buffer);
  }

 private:
  std::string name_;
};

FileStreamOptions options_of(const std::string& name) {
  return {.folder = "files",
          .owner = "module " + name,
          .singular = "piece",
          .plural = "pieces",
          .buffer_bytes = buffer_bytes,
          .encoder = std::make_shared<Copying>(name)};
}

std::string content_of(std::int64_t time_ns, std::size_t bytes) {
  std::string content(bytes, ' ');
  for (std::size_t i = 0; i < bytes; ++i)
    content[i] = static_cast<char>(31 * time_ns + 7 * static_cast<std::int64_t>(i));
  return content;
}

/// Hands over a buffer; false: it is dropped.
bool send(FileStream& stream, std::int64_t time_ns, std::size_t bytes = buffer_bytes) {
  const std::span<std::byte> buffer = stream.begin();
  if (buffer.empty()) return false;
  for (std::size_t i = 0; i < bytes; ++i)
    buffer[i] = static_cast<std::byte>(31 * time_ns + 7 * static_cast<std::int64_t>(i));
  stream.finish(bytes, time_ns);
  return true;
}

TEST(FileStreams, FilesHaveWhatTheTickFilledIn) {
  for (const bool virtual_clock : {true, false}) {
    const TemporaryFolder folder;
    RunFileStreams files(folder.path(), virtual_clock);
    const auto front = files.open(options_of("front"));
    const auto rear = files.open(options_of("rear"));
    ASSERT_TRUE(send(*front, 0));
    ASSERT_TRUE(send(*front, 40, 5));
    ASSERT_TRUE(send(*rear, 7, 0));
    const RunFileStreams::Shortfalls shortfalls = files.close();
    EXPECT_TRUE(shortfalls.failures.empty() && shortfalls.limits.empty());
    EXPECT_EQ(folder.read("files/front-0"), content_of(0, buffer_bytes));
    EXPECT_EQ(folder.read("files/front-40"), content_of(40, 5));
    EXPECT_EQ(folder.read("files/rear-7"), "");
    EXPECT_EQ(front->record().last_file, "files/front-40");
    EXPECT_EQ(front->record().last_time_ns, 40);
    EXPECT_EQ(front->record().dropped + front->record().beyond_limit, 0U);
    EXPECT_FALSE(send(*rear, 9)) << "the files are closed";
    EXPECT_TRUE(files.close().failures.empty());
  }
}

TEST(FileStreams, WriteImages) {
  struct Grey final : modules::FileEncoder {
    void encode(std::span<std::byte> buffer, std::int64_t /*time_ns*/, modules::FileOutput& output) override {
      const std::span samples(reinterpret_cast<const std::uint8_t*>(buffer.data()), buffer.size());
      output.write("a.png", {.width = 4, .height = 2, .pixels = modules::PngImage::Grey8{samples}});
    }
  };
  const TemporaryFolder folder;
  RunFileStreams files(folder.path(), true);
  FileStreamOptions options = options_of("grey");
  options.folder = "images";
  options.encoder = std::make_shared<Grey>();
  const auto stream = files.open(options);
  ASSERT_TRUE(send(*stream, 3, 8));
  EXPECT_TRUE(files.close().failures.empty());
  const tests::PngContent png = tests::read_png(folder.path() / "images/a.png");
  EXPECT_EQ(png.width, 4U);
  EXPECT_EQ(png.channels, 1);
  ASSERT_EQ(png.samples.size(), 8U);
  EXPECT_EQ(png.samples[7], static_cast<std::uint8_t>(31 * 3 + 7 * 7));
}

TEST(FileStreams, NoFolderIsMadeWithoutAStream) {
  const TemporaryFolder folder;
  RunFileStreams files(folder.path(), false);
  EXPECT_TRUE(files.close().failures.empty());
  EXPECT_TRUE(std::filesystem::is_empty(folder.path()));
}

TEST(FileStreams, UnderTheVirtualClockNothingIsDropped) {
  const TemporaryFolder folder;
  RunFileStreams files(folder.path(), true);
  const auto front = files.open(options_of("front"));
  for (int k = 0; k < 50; ++k)
    ASSERT_TRUE(send(*front, k)) << k;
  EXPECT_TRUE(files.close().failures.empty());
  for (int k = 0; k < 50; ++k)
    EXPECT_EQ(folder.read("files/front-" + std::to_string(k)), content_of(k, buffer_bytes));
}

// The first file is a pipe, which blocks the writing thread until the test reads it.
TEST(FileStreams, WhatTheDiskIsTooSlowForIsCounted) {
  const TemporaryFolder folder;
  RunFileStreams files(folder.path(), false);
  const auto front = files.open(options_of("front"));
  const std::filesystem::path pipe = folder.path() / "files/front-0";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  int sent = 0;
  allocation_guard::reset();
  allocation_guard::enter_tick();
  while (send(*front, sent))
    ++sent;
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
  EXPECT_EQ(sent, 3) << "the buffers of a stream";
  EXPECT_EQ(tests::content_of(pipe), content_of(0, buffer_bytes));
  ASSERT_TRUE(tests::eventually([&] { return send(*front, 99); }));
  const RunFileStreams::Shortfalls shortfalls = files.close();
  const std::uint64_t dropped = front->record().dropped;
  EXPECT_GE(dropped, 1U);
  ASSERT_EQ(shortfalls.failures.size(), 1U);
  EXPECT_EQ(shortfalls.failures[0], std::to_string(dropped) +
                                        (dropped == 1 ? " piece of module front is not in a file"
                                                      : " pieces of module front are not in files") +
                                        ": the disk was too slow");
  EXPECT_EQ(folder.read("files/front-2"), content_of(2, buffer_bytes));
  EXPECT_EQ(folder.read("files/front-99"), content_of(99, buffer_bytes));
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "files/front-3")) << "the dropped one";
}

TEST(FileStreams, EndAtTheirLargestSize) {
  const TemporaryFolder folder;
  RunFileStreams files(folder.path(), true);
  FileStreamOptions options = options_of("front");
  options.max_bytes = 1;
  const auto front = files.open(options);
  for (int k = 0; k < 5; ++k)
    ASSERT_TRUE(send(*front, k));
  const RunFileStreams::Shortfalls shortfalls = files.close();
  EXPECT_EQ(front->record().beyond_limit, 4U);
  EXPECT_EQ(front->record().last_file, "files/front-0");
  EXPECT_FALSE(std::filesystem::exists(folder.path() / "files/front-1"));
  EXPECT_TRUE(shortfalls.failures.empty());
  ASSERT_EQ(shortfalls.limits.size(), 1U);
  EXPECT_EQ(shortfalls.limits[0],
            "the files of module front reached 1 B ('max_size'); 4 pieces after that are not in files");
}

TEST(FileStreams, FileThatCanNotBeWrittenIsReported) {
  const TemporaryFolder folder;
  RunFileStreams files(folder.path(), true);
  const auto front = files.open(options_of("front"));
  std::filesystem::create_directory(folder.path() / "files/front-1");
  ASSERT_TRUE(send(*front, 0));
  ASSERT_TRUE(send(*front, 1));
  const RunFileStreams::Shortfalls shortfalls = files.close();
  ASSERT_EQ(shortfalls.failures.size(), 1U);
  EXPECT_NE(shortfalls.failures[0].find("1 piece of module front could not be written; the first: "),
            std::string::npos);
  EXPECT_NE(shortfalls.failures[0].find("front-1 can not be written"), std::string::npos);
  EXPECT_EQ(front->record().last_file, "files/front-0");
}

TEST(FileStreams, AFolderOfAnotherNameIsMisuse) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const TemporaryFolder folder;
  RunFileStreams files(folder.path(), true);
  FileStreamOptions options = options_of("front");
  options.folder = "database";
  EXPECT_DEATH(files.open(options), "misuse");
}

}  // namespace
}  // namespace hil::run
