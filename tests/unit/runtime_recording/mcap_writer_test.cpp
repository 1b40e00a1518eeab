#include "runtime/recording/mcap_writer.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <random>

#include "io/device.hpp"
#include "mcap_reader.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::recording {
namespace {

constexpr std::uint64_t large = std::uint64_t{1} << 40;

std::string join(const std::vector<std::string>& all) {
  std::string text;
  for (const std::string& one : all)
    text += one + "\n";
  return text;
}

class McapWriterTest : public ::testing::Test {
 protected:
  test::ReadMcap read() const {
    test::ReadMcap file = test::read_mcap(folder_.read("r.mcap"));
    EXPECT_EQ(join(file.faults), "");
    return file;
  }
  std::uint64_t size() const { return std::filesystem::file_size(file_); }
  static std::uint16_t topic(McapWriter& writer, const std::string& name) {
    std::uint16_t channel = 0;
    EXPECT_TRUE(writer.add_topic({"/" + name, "hil." + name, R"({"type":"object"})"}, channel));
    return channel;
  }
  /// Digits that zstd can not make much shorter.
  std::string noise(std::size_t size) {
    std::string text;
    while (text.size() < size)
      text += static_cast<char>(random_() & 0xFFU);
    return text;
  }

  const tests::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "r.mcap";
  std::mt19937 random_{7};
};

TEST_F(McapWriterTest, EmptyRecordingIsComplete) {
  McapWriter writer(file_, large);
  topic(writer, "a");
  EXPECT_EQ(writer.close(), "");
  EXPECT_EQ(writer.close(), "") << "may be closed again";
  const test::ReadMcap file = read();
  EXPECT_EQ(writer.bytes(), size());
  EXPECT_TRUE(file.messages.empty());
  EXPECT_TRUE(file.chunks.empty());
  EXPECT_EQ(file.first_ns, 0U);
  EXPECT_EQ(file.last_ns, 0U);
  EXPECT_EQ(file.schemas.at("/a"), R"({"type":"object"})");
}

TEST_F(McapWriterTest, FileWithoutATopicIsComplete) {
  McapWriter writer(file_, large);
  EXPECT_EQ(writer.close(), "");
  EXPECT_TRUE(read().schemas.empty());
}

TEST_F(McapWriterTest, MessagesAreReadBackInSeveralChunks) {
  McapWriter writer(file_, large);
  EXPECT_TRUE(writer.add_metadata("run", {{"scenario", "tank"}, {"seed", "7"}}));
  const std::uint16_t a = topic(writer, "a"), b = topic(writer, "b"), silent = topic(writer, "silent");
  EXPECT_EQ((std::vector{a, b, silent}), (std::vector<std::uint16_t>{0, 1, 2}));
  constexpr int count = 40'000;
  for (int i = 0; i < count; ++i) {
    const std::string data = "{\"x\":" + std::to_string(i) + "}";
    ASSERT_TRUE(writer.write(i % 3 == 0 ? b : a, std::int64_t{1'000'000} * i, data, large));
  }
  EXPECT_TRUE(writer.add_metadata("recording", {{"dropped", "0"}}));
  EXPECT_EQ(writer.close(), "");
  EXPECT_EQ(writer.bytes(), size());
  EXPECT_EQ(writer.messages(), std::uint64_t{count});
  const test::ReadMcap file = read();
  EXPECT_GE(file.chunks.size(), 2U);
  EXPECT_EQ(file.metadata.at("run").at("scenario"), "tank");
  EXPECT_EQ(file.metadata.at("run").at("seed"), "7");
  EXPECT_EQ(file.metadata.at("recording").at("dropped"), "0");
  ASSERT_EQ(file.messages.size(), std::size_t{count});
  for (int i = 0; i < count; ++i) {
    const test::ReadMessage& message = file.messages[static_cast<std::size_t>(i)];
    ASSERT_EQ(message.topic, i % 3 == 0 ? "/b" : "/a");
    ASSERT_EQ(message.log_time, std::uint64_t{1'000'000} * static_cast<unsigned>(i));
    ASSERT_EQ(message.publish_time, message.log_time);
    ASSERT_EQ(message.data, "{\"x\":" + std::to_string(i) + "}");
  }
  EXPECT_EQ(file.first_ns, 0U);
  EXPECT_EQ(file.last_ns, std::uint64_t{39'999'000'000});
}

TEST_F(McapWriterTest, TimesMayBeInAnyOrder) {
  McapWriter writer(file_, large);
  const std::uint16_t a = topic(writer, "a");
  for (const std::int64_t time : {5, 2, 9, 0, 7})
    ASSERT_TRUE(writer.write(a, time, "{}", large));
  writer.close();
  const test::ReadMcap file = read();
  ASSERT_EQ(file.chunks.size(), 1U);
  EXPECT_EQ(file.chunks[0].begin_ns, 0U);
  EXPECT_EQ(file.chunks[0].end_ns, 9U);
  EXPECT_EQ(file.first_ns, 0U);
  EXPECT_EQ(file.last_ns, 9U);
}

TEST_F(McapWriterTest, FileIsNeverLongerThanItsLimitAndNearlyThatLong) {
  for (const std::uint64_t limit :
       {std::uint64_t{100'000}, std::uint64_t{1'500'001}, std::uint64_t{5'000'000}}) {
    for (const std::size_t message_size : {std::size_t{1}, std::size_t{200}, std::size_t{9'000}}) {
      McapWriter writer(file_, limit);
      const std::uint16_t a = topic(writer, "a"), b = topic(writer, "b");
      std::int64_t time = 0;
      while (writer.write(time % 2 == 0 ? a : b, time, noise(message_size), limit))
        ++time;
      EXPECT_FALSE(writer.write(a, time, noise(message_size), limit)) << "stays full";
      EXPECT_EQ(writer.close(), "");
      EXPECT_EQ(read().messages.size(), static_cast<std::size_t>(time));
      EXPECT_EQ(writer.bytes(), size());
      EXPECT_LE(size(), limit);
      EXPECT_GT(size(), limit - limit / 10) << limit << " " << message_size;
    }
  }
}

TEST_F(McapWriterTest, LimitOfACallLeavesTheRestForLaterCalls) {
  McapWriter writer(file_, 1'000'000);
  const std::uint16_t a = topic(writer, "a");
  while (writer.write(a, 1, noise(500), 600'000)) {
  }
  EXPECT_TRUE(writer.write(a, 2, noise(300'000), 1'000'000));
  EXPECT_FALSE(writer.write(a, 3, noise(200'000), 1'000'000));
  EXPECT_EQ(writer.close(), "");
  EXPECT_EQ(read().last_ns, 2U);
  EXPECT_LE(size(), 1'000'000U);
}

TEST_F(McapWriterTest, TopicsAndMetadataThatDoNotFitAreRefused) {
  McapWriter writer(file_, 2'000);
  std::uint16_t channel = 77;
  EXPECT_FALSE(writer.add_topic({"/a", "a", std::string(1'000, ' ')}, channel));
  EXPECT_EQ(channel, 77U);
  EXPECT_FALSE(writer.add_metadata("m", {{"k", std::string(2'000, 'v')}}));
  EXPECT_EQ(writer.close(), "");
  EXPECT_TRUE(read().metadata.empty());
  EXPECT_LE(size(), 2'000U);
}

TEST_F(McapWriterTest, SameCallsMakeTheSameBytes) {
  std::string first;
  for (int round = 0; round < 2; ++round) {
    McapWriter writer(file_, large);
    const std::uint16_t a = topic(writer, "a");
    for (int i = 0; i < 50'000; ++i)
      ASSERT_TRUE(writer.write(a, i, "{\"x\":" + std::to_string(i * 7) + "}", large));
    writer.close();
    if (round == 0) first = folder_.read("r.mcap");
  }
  EXPECT_TRUE(folder_.read("r.mcap") == first);
}

TEST_F(McapWriterTest, DamagedFilesAreFound) {
  McapWriter writer(file_, large);
  writer.add_metadata("run", {{"seed", "1"}});
  const std::uint16_t a = topic(writer, "a");
  for (int i = 0; i < 10; ++i)
    ASSERT_TRUE(writer.write(a, i, "{}", large));
  writer.close();
  const std::string bytes = folder_.read("r.mcap");
  for (std::size_t at = 0; at < bytes.size(); ++at) {
    std::string damaged = bytes;
    damaged[at] = static_cast<char>(damaged[at] ^ 0x10);
    EXPECT_FALSE(test::read_mcap(damaged).faults.empty()) << "the reader of these tests finds byte " << at;
  }
}

TEST_F(McapWriterTest, FullDiskIsReported) {
  McapWriter writer("/dev/full", large);
  const std::uint16_t a = topic(writer, "a");
  EXPECT_TRUE(writer.write(a, 0, "{}", large));
  const std::string fault = writer.close();
  EXPECT_EQ(fault, "/dev/full could not be written completely: No space left on device");
}

TEST_F(McapWriterTest, FileChangedByAnotherProgramIsReported) {
  McapWriter writer(file_, large);
  const std::uint16_t a = topic(writer, "a");
  std::filesystem::resize_file(file_, 0);
  EXPECT_TRUE(writer.write(a, 0, "{}", large));
  EXPECT_NE(writer.close().find("r.mcap was changed by another program"), std::string::npos);
}

TEST_F(McapWriterTest, FileThatCanNotBeCreatedIsRefusedWithItsName) {
  try {
    McapWriter writer(folder_.path() / "no" / "such.mcap", large);
    FAIL() << "no error";
  } catch (const io::DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("such.mcap can not be written: No such file"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace hil::recording
