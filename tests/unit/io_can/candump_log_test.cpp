#include "io/can/candump_log.hpp"

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <random>

#include "tests/support/temporary_folder.hpp"

namespace hil::io::can {
namespace {

std::string line_of(const Frame& frame) {
  std::string text;
  append_candump_line(text, frame, "vcan0");
  return text;
}

TEST(CandumpLog, WritesTheFormatOfCandump) {
  const std::array<std::uint8_t, 5> bytes{0x2A, 0x36, 0x6C, 0x2B, 0xBA};
  Frame frame = make_frame(0x44, bytes);
  frame.wall_ns = 1436509052'249713999;
  EXPECT_EQ(line_of(frame), "(1436509052.249713) vcan0 044#2A366C2BBA");
  frame.wall_ns = 10'000'000;
  EXPECT_EQ(line_of(frame), "(0000000000.010000) vcan0 044#2A366C2BBA");
  EXPECT_EQ(line_of(make_frame(0x1234567 | CAN_EFF_FLAG, {})), "(0000000000.000000) vcan0 01234567#");
  EXPECT_EQ(line_of(make_frame(0x7FF | CAN_RTR_FLAG, {})), "(0000000000.000000) vcan0 7FF#R");
  EXPECT_EQ(line_of(make_frame(0x7FF | CAN_RTR_FLAG, std::span(bytes).first(4))),
            "(0000000000.000000) vcan0 7FF#R4");
  Frame fd = make_frame(0x123, std::span(bytes).first(2), true);
  fd.raw.flags = 1;
  EXPECT_EQ(line_of(fd), "(0000000000.000000) vcan0 123##12A36");
  EXPECT_EQ(line_of(make_frame(0x4 | CAN_ERR_FLAG, std::span(bytes).first(1))),
            "(0000000000.000000) vcan0 20000004#2A");
}

TEST(CandumpLog, ReadsWhatItWrites) {
  std::mt19937_64 random(3);
  constexpr std::array<std::size_t, 8> fd_lengths{0, 5, 8, 12, 24, 32, 48, 64};
  for (int round = 0; round < 20000; ++round) {
    std::array<std::uint8_t, 64> bytes{};
    for (auto& byte : bytes)
      byte = static_cast<std::uint8_t>(random());
    const bool is_fd = random() % 3 == 0;
    const std::size_t length = is_fd ? fd_lengths[random() % 8] : random() % 9;
    canid_t id = random() % 2 == 0 ? static_cast<canid_t>(random() & CAN_SFF_MASK)
                                   : static_cast<canid_t>(random() & CAN_EFF_MASK) | CAN_EFF_FLAG;
    const bool is_remote = !is_fd && random() % 5 == 0;
    if (is_remote) {
      id |= CAN_RTR_FLAG;
      bytes.fill(0);
    }
    Frame frame = make_frame(id, std::span(bytes).first(length), is_fd);
    if (is_fd) frame.raw.flags = static_cast<std::uint8_t>(random() % 16);
    frame.wall_ns = static_cast<std::int64_t>(random() % 2'000'000'000) * 1'000'000'000 +
                    static_cast<std::int64_t>(random() % 1'000'000) * 1000;
    const auto again = parse_candump_line(line_of(frame));
    ASSERT_TRUE(again) << line_of(frame);
    ASSERT_TRUE(again->frame.same_content(frame)) << line_of(frame);
    ASSERT_EQ(again->frame.wall_ns, frame.wall_ns);
    ASSERT_EQ(again->interface, "vcan0");
  }
}

TEST(CandumpLog, RefusesMalformedLines) {
  for (const char* line :
       {"", "hello", "(1.5) vcan0 044#00", "(1.000000) vcan0", "(1.000000)  044#00", "(1.000000) vcan0 44#00",
        "(1.000000) vcan0 FFF#00", "(1.000000) vcan0 044#0", "(1.000000) vcan0 044#001122334455667788",
        "(1.000000) vcan0 044#0G", "(1.000000) vcan0 044##", "(1.000000) vcan0 044#R9",
        "(x.000000) vcan0 044#00", "(1.000000) vcan0 04400", "(-1.000000) vcan0 044#00",
        "(99999999999999999999.000000) vcan0 044#00", "(1.000000) vcan0 123##100112233445566778899"}) {
    EXPECT_FALSE(parse_candump_line(line)) << line;
  }
  EXPECT_TRUE(parse_candump_line("(1.000000) vcan0 044#00 R\r\n")) << "candump -x appends the direction";
}

TEST(CandumpLog, SaysWhichFieldOfALineIsWrong) {
  const struct {
    const char* line;
    std::size_t column;
    const char* text;
  } all[] = {
      {"vcan0  123   [2]  11 22", 1, "the line does not begin with a time in parentheses"},
      {"(1.000000 vcan0 123#", 1, "the parenthesis of the time does not close"},
      {"(1.5) vcan0 044#00", 2, "the time does not have six decimals"},
      {"(x.000000) vcan0 044#00", 2, "the time is no number of seconds"},
      {"(1.00000x) vcan0 044#00", 2, "the time is no number of seconds"},
      {"(-1.000000) vcan0 044#00", 2, "the time is below 0 s or beyond the year 2262"},
      {"(9999999999999.000000) vcan0 044#00", 2, "the time is below 0 s or beyond the year 2262"},
      {"(99999999999999999999.000000) v 044#00", 2, "the time is below 0 s or beyond the year 2262"},
      {"(1.000000)", 11, "the time is not followed by one space and an interface"},
      {"(1.000000)  044#00", 12, "the time is not followed by one space and an interface"},
      {"(1.000000) vcan0", 17, "no frame follows the interface"},
      {"(1.000000) v 04400", 14, "the frame has no '#' between identifier and payload"},
      {"(1.000000) v 44#00", 14, "the identifier does not have 3 or 8 hexadecimal digits"},
      {"(1.000000) v 04G#00", 14, "the identifier does not have 3 or 8 hexadecimal digits"},
      {"(1.000000) v FFF#00", 14, "the identifier of 3 digits is above 7FF"},
      {"(1.000000) v 40000001#", 14, "the identifier of 8 digits is above 1FFFFFFF"},
      {"(1.000000) v 044##", 19, "'##' is not followed by a hexadecimal digit, the flags of a CAN FD frame"},
      {"(1.000000) v 044#0G", 18, "the payload has a character that is no hexadecimal digit"},
      {"(1.000000) v 044#0", 18, "the payload has an odd number of hexadecimal digits"},
      {"(1.000000) v 044#001122334455667788", 18,
       "the payload of a classic frame has more than 8 bytes; that of CAN FD is behind '##'"},
      {"(1.000000) v 123##100112233445566778899", 20,
       "the payload of a CAN FD frame has a length other than 0 to 8, 12, 16, 20, 24, 32, 48 and 64 bytes"},
      {"(1.000000) v 044#R9", 18, "the length behind 'R' is not one digit from 0 to 8"},
      {"(1.000000) v 123#R8_8", 20, "the data length code is not one digit from 9 to F"},
      {"(1.000000) v 123#11_C", 20, "only a classic frame of 8 bytes can have a data length code"},
      {"(1.000000) v 123#R_C", 19, "only a classic frame of 8 bytes can have a data length code"},
      {"(1.000000) v 123##11122334455667788_C", 36, "a CAN FD frame has no data length code"},
  };
  for (const auto& one : all) {
    CandumpMistake fault;
    EXPECT_FALSE(parse_candump_line(one.line, &fault)) << one.line;
    EXPECT_EQ(fault.text, one.text) << one.line;
    EXPECT_EQ(fault.column, one.column) << one.line;
  }
}

TEST(CandumpLog, ReadsLengthCodesAndDirections) {
  const auto request = parse_candump_line("(0.000001) vcan0 123#R8_C");
  ASSERT_TRUE(request);
  EXPECT_TRUE(request->frame.is_remote());
  EXPECT_EQ(request->frame.raw.len, 8U);
  EXPECT_EQ(request->frame.raw.__res1, 0xCU);
  const auto data = parse_candump_line("(0.000001) vcan0 123#1122334455667788_E");
  ASSERT_TRUE(data);
  EXPECT_EQ(data->frame.raw.len, 8U);
  EXPECT_EQ(data->frame.raw.data[7], 0x88U);
  EXPECT_EQ(data->frame.raw.__res1, 0xEU);
  const auto sent = parse_candump_line("(0.000001) vcan0 123#R8_C T");
  ASSERT_TRUE(sent);
  EXPECT_EQ(sent->frame.direction, Direction::tx);
  EXPECT_EQ(parse_candump_line("(0.000001) vcan0 123#11 R")->frame.direction, Direction::rx);
  EXPECT_TRUE(parse_candump_line("(0.000001) vcan0 123##100 T"));
  for (const char* line :
       {"(0.000001) vcan0 123#R8_8", "(0.000001) vcan0 123#R7_C", "(0.000001) vcan0 123#R_C",
        "(0.000001) vcan0 123#11_C", "(0.000001) vcan0 123#1122334455667788_",
        "(0.000001) vcan0 123#1122334455667788_CC", "(0.000001) vcan0 123#_C",
        "(0.000001) vcan0 123##11122334455667788_C"})
    EXPECT_FALSE(parse_candump_line(line)) << line;
}

TEST(CandumpLog, WriterKeepsEveryFrameInOrder) {
  const tests::TemporaryFolder folder;
  const auto file = folder / "frames.log";
  constexpr std::uint32_t count = 20000;
  {
    CandumpLogWriter writer(file, "car", CandumpLogWriter::WhenFull::wait, 100);
    for (std::uint32_t index = 0; index < count; ++index) {
      Frame frame = make_frame(index % 0x800, {});
      frame.wall_ns = std::int64_t{index} * 1000;
      writer.push(frame);
    }
    writer.close();
    EXPECT_EQ(writer.dropped(), 0U);
    EXPECT_EQ(writer.fault(), "");
  }
  const CandumpLog log = read_candump_log(file);
  EXPECT_EQ(log.fault, "");
  EXPECT_TRUE(log.bad_lines.empty());
  ASSERT_EQ(log.frames.size(), count);
  for (std::uint32_t index = 0; index < count; ++index) {
    ASSERT_EQ(log.frames[index].frame.wall_ns, std::int64_t{index} * 1000);
    ASSERT_EQ(log.frames[index].frame.raw.can_id, index % 0x800);
  }
}

TEST(CandumpLog, WriterCountsDroppedFrames) {
  const tests::TemporaryFolder folder;
  const auto file = folder / "frames.log";
  constexpr std::uint64_t count = 50000;
  std::uint64_t dropped = 0;
  {
    CandumpLogWriter writer(file, "car", CandumpLogWriter::WhenFull::drop, 8);
    for (std::uint64_t index = 0; index < count; ++index)
      writer.push(make_frame(1, {}));
    writer.close();
    dropped = writer.dropped();
  }
  EXPECT_EQ(read_candump_log(file).frames.size() + dropped, count);
}

TEST(CandumpLog, ReportsAFullDisk) {
  CandumpLogWriter writer("/dev/full", "car", CandumpLogWriter::WhenFull::wait);
  writer.push(make_frame(1, {}));
  writer.close();
  EXPECT_NE(writer.fault().find("No space left"), std::string::npos) << writer.fault();
  EXPECT_EQ(writer.dropped(), 1U);
}

TEST(CandumpLog, ReportsAFileTruncatedByAnotherProgram) {
  const tests::TemporaryFolder folder;
  const auto file = folder / "frames.log";
  CandumpLogWriter writer(file, "car", CandumpLogWriter::WhenFull::wait, 1);
  writer.push(make_frame(1, {}));
  writer.push(make_frame(2, {}));
  writer.push(make_frame(3, {}));  // the first is in the file
  std::filesystem::resize_file(file, 0);
  writer.close();
  EXPECT_NE(writer.fault().find("was changed by another program"), std::string::npos) << writer.fault();
}

TEST(CandumpLog, ReportsFilesThatCanNotBeOpened) {
  EXPECT_THROW(CandumpLogWriter("/nowhere/x.log", "car", CandumpLogWriter::WhenFull::drop), DeviceError);
  EXPECT_NE(read_candump_log("/nowhere/x.log").fault.find("No such file"), std::string::npos);
}

TEST(CandumpLog, ReportsTheNumbersOfBadLines) {
  const tests::TemporaryFolder folder;
  const auto file = folder / "frames.log";
  std::ofstream(file) << "(1.000000) a 044#00\nnot a frame\n\n(2.000000) a 045#\n";
  const CandumpLog log = read_candump_log(file);
  EXPECT_EQ(log.frames.size(), 2U);
  EXPECT_EQ(log.bad_lines, (std::vector<std::size_t>{2}));
}

}  // namespace
}  // namespace hil::io::can
