#include "runtime/recording/recorder.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <thread>

#include "io/can/bus_frame.hpp"
#include "io/device.hpp"
#include "mcap_reader.hpp"
#include "runtime/buses/can/can_frame_format.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::recording {
namespace {

using Json = nlohmann::json;

constexpr std::int64_t ms = 1'000'000;
constexpr double nan_value = std::numeric_limits<double>::quiet_NaN();

class RecorderTest : public ::testing::Test {
 protected:
  signals::SignalId add(const std::string& name, const std::string& writer, bool arrives = false) {
    const signals::SignalId signal =
        table_.add({.name = name, .unit = "m", .writer = writer, .arrives = arrives});
    all_.push_back(signal);
    return signal;
  }
  void open(bool virtual_clock = true, std::uint64_t max_bytes = std::uint64_t{1} << 30) {
    const contribution::FrameFormat format = buses::can::can_frame_format();
    recorder_ =
        std::make_unique<Recorder>(RecorderOptions{.file = file_,
                                                   .max_bytes = max_bytes,
                                                   .virtual_clock = virtual_clock,
                                                   .frame_buses = {{"can.car", format}, {"can.body", format}},
                                                   .about_run = {{"seed", "3"}}},
                                   table_, all_);
  }
  static void take(io::FrameSink& sink, const io::can::BusFrame& frame) {
    io::take_frame(sink, frame.time_ns, frame);
  }
  void take(std::int64_t time_ns) { recorder_->take(table_, time_ns); }
  test::ReadMcap close(const std::vector<RecordedEvent>& events = {},
                       const std::vector<RecordedMiss>& misses = {}) {
    result_ = recorder_->close(events, misses);
    recorder_.reset();
    EXPECT_EQ(result_.fault, "");
    test::ReadMcap file = test::read_mcap(folder_.read("r.mcap"));
    for (const std::string& fault : file.faults)
      ADD_FAILURE() << fault;
    EXPECT_EQ(result_.bytes, std::filesystem::file_size(file_));
    EXPECT_EQ(result_.messages, file.messages.size());
    return file;
  }
  static std::string text(const std::vector<test::ReadMessage>& messages) {
    std::string all;
    for (const test::ReadMessage& message : messages)
      all += std::to_string(message.log_time / ms) + " " + message.data + "\n";
    return all;
  }

  const tests::TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "r.mcap";
  signals::SignalTable table_;
  std::vector<signals::SignalId> all_;
  std::unique_ptr<Recorder> recorder_;
  RecordingResult result_;
};

TEST_F(RecorderTest, EachTopicHasTheRateOfItsWriter) {
  const auto fast = add("fast.x", "module fast"), slow = add("slow.x", "module slow");
  const auto slow_y = add("slow.y", "module slow");
  add("never.x", "module never");
  open();
  for (int tick = 0; tick < 100; ++tick) {
    table_.write(fast, tick, tick * ms);
    if (tick % 10 == 3) {
      table_.write(slow, tick, tick * ms);
      table_.write(slow_y, -tick, tick * ms);
    }
    take(tick * ms);
  }
  const test::ReadMcap file = close();
  const auto fast_messages = file.of("/fast"), slow_messages = file.of("/slow");
  ASSERT_EQ(fast_messages.size(), 100U);
  ASSERT_EQ(slow_messages.size(), 10U);
  EXPECT_TRUE(file.of("/never").empty());
  EXPECT_TRUE(file.schemas.contains("/never"));
  for (std::size_t i = 0; i < 10; ++i) {
    EXPECT_EQ(slow_messages[i].log_time, (10 * i + 3) * ms);
    EXPECT_EQ(slow_messages[i].publish_time, (10 * i + 3) * ms);
    const std::string value = std::to_string(10 * i + 3);
    EXPECT_EQ(slow_messages[i].data, "{\"x\":" + value + ",\"y\":-" + value + "}");
  }
  EXPECT_EQ(file.metadata.at("run").at("seed"), "3");
  EXPECT_EQ(file.metadata.at("recording").at("dropped"), "0");
}

TEST_F(RecorderTest, SameValueWrittenAgainIsRecorded) {
  const auto signal = add("a.x", "module a");
  open();
  for (int tick = 0; tick < 3; ++tick) {
    table_.write(signal, 5.0, tick * ms);
    take(tick * ms);
  }
  EXPECT_EQ(text(close().of("/a")), "0 {\"x\":5}\n1 {\"x\":5}\n2 {\"x\":5}\n");
}

TEST_F(RecorderTest, UnknownValuesAreNull) {
  const auto speed = add("can.car.M.v", "can.car", true), state = add("m.x", "module m");
  open();
  table_.write(state, nan_value, 0);
  take(0);
  table_.write(speed, {.value = 4.5, .time_ns = -3 * ms, .fresh = true});
  take(1 * ms);
  table_.write(state, std::numeric_limits<double>::infinity(), 2 * ms);
  take(2 * ms);
  // Not fresh any more: its safe value, at the time of its last arrival.
  table_.write(speed, {.value = 0.0, .time_ns = -3 * ms, .fresh = false});
  take(3 * ms);
  take(4 * ms);
  const test::ReadMcap file = close();
  EXPECT_EQ(text(file.of("/m")), "0 {\"x\":null}\n2 {\"x\":null}\n");
  EXPECT_EQ(text(file.of("/can.car.M")), "1 {\"v\":4.5}\n3 {\"v\":null}\n");
}

TEST_F(RecorderTest, NumbersAreReadBackExactly) {
  const std::vector<double> values{0.1, 1.0 / 3.0, 1e300, -1e-300, 5e-324, std::numeric_limits<double>::max(),
                                   1e22};
  const auto signal = add("a.x", "module a");
  open();
  for (std::size_t i = 0; i < values.size(); ++i) {
    table_.write(signal, values[i], static_cast<std::int64_t>(i));
    take(static_cast<std::int64_t>(i));
  }
  const auto messages = close().of("/a");
  ASSERT_EQ(messages.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i)
    EXPECT_EQ(Json::parse(messages[i].data)["x"].get<double>(), values[i]);
}

TEST_F(RecorderTest, FramesHaveTheirTimesAndContents) {
  add("a.x", "module a");
  open();
  EXPECT_EQ(recorder_->frame_sink("modbus.plc"), nullptr);
  io::FrameSink& car = *recorder_->frame_sink("can.car");
  io::FrameSink& body = *recorder_->frame_sink("can.body");
  io::can::BusFrame frame{.time_ns = -5, .id = 0x123, .size = 3};
  frame.data = {0x00, 0xAB, 0x0F};
  take(car, frame);
  frame = {.time_ns = 2'500'000, .id = 0x18FF0001, .extended = true, .fd = true, .sent = true, .size = 12};
  frame.data.fill(0x5A);
  take(body, frame);
  take(car, {.time_ns = 3 * ms, .id = 0x7, .remote = true, .size = 8});
  take(car, {.time_ns = 4 * ms, .id = 0x40, .error = true, .size = 8});
  const test::ReadMcap file = close();
  EXPECT_EQ(text(file.of("/frames/can.car")),
            R"(0 {"id":291,"extended":false,"direction":"rx","kind":"data","fd":false,"dlc":3,"data":"00ab0f"}
3 {"id":7,"extended":false,"direction":"rx","kind":"remote","fd":false,"dlc":8,"data":""}
4 {"id":64,"extended":false,"direction":"rx","kind":"error","fd":false,"dlc":8,"data":"0000000000000000"}
)");
  const auto of_body = file.of("/frames/can.body");
  ASSERT_EQ(of_body.size(), 1U);
  EXPECT_EQ(of_body[0].log_time, 2'500'000U);
  EXPECT_EQ(of_body[0].data,
            R"({"id":419364865,"extended":true,"direction":"tx","kind":"data","fd":true,"dlc":9,"data":")"
            R"(5a5a5a5a5a5a5a5a5a5a5a5a"})");
}

TEST_F(RecorderTest, LengthCodesOfLongFrames) {
  open();
  for (const int size : {8, 12, 16, 20, 24, 32, 48, 64})
    take(*recorder_->frame_sink("can.car"), {.fd = true, .size = static_cast<std::uint8_t>(size)});
  std::string codes;
  for (const test::ReadMessage& message : close().of("/frames/can.car"))
    codes += Json::parse(message.data)["dlc"].dump() + " ";
  EXPECT_EQ(codes, "8 9 10 11 12 13 14 15 ");
}

TEST_F(RecorderTest, EventsAndMissesAreInTheOrderOfTheirTimes) {
  const auto signal = add("a.x", "module a");
  open();
  for (int tick = 0; tick < 10; ++tick) {
    table_.write(signal, tick, tick * ms);
    take(tick * ms);
  }
  const test::ReadMcap file =
      close({{-7, "plc said \"no\"\n"}, {2 * ms + 5, "bad \xFF byte"}},
            {{4 * ms, "a", 4, "own work", 1'500}, {1 * ms, "b", 1, "database", 2'000'000'001}});
  EXPECT_EQ(text(file.of("/events")),
            "0 {\"time\":0.000000000,\"text\":\"plc said \\\"no\\\"\\n\"}\n"
            "2 {\"time\":0.002000005,\"text\":\"bad \xEF\xBF\xBD byte\"}\n");
  EXPECT_EQ(text(file.of("/misses")),
            "1 {\"task\":\"b\",\"tick\":1,\"cause\":\"database\",\"lateness\":2.000000001}\n"
            "4 {\"task\":\"a\",\"tick\":4,\"cause\":\"own work\",\"lateness\":0.000001500}\n");
}

TEST_F(RecorderTest, LosesNothingUnderTheVirtualClockAndMakesTheSameBytes) {
  std::vector<signals::SignalId> signals;
  for (int i = 0; i < 300; ++i)
    signals.push_back(add("a.x" + std::to_string(i), "module a"));
  std::string first;
  for (int round = 0; round < 2; ++round) {
    open();
    constexpr int ticks = 20'000;  // three times what the ring holds
    for (int tick = 0; tick < ticks; ++tick) {
      for (const auto signal : signals)
        table_.write(signal, tick % 7, tick * ms);
      take(tick * ms);
      take(*recorder_->frame_sink("can.car"), {.time_ns = tick * ms, .id = 1});
      take(*recorder_->frame_sink("can.car"), {.time_ns = tick * ms, .id = 2});
    }
    const test::ReadMcap file = close();
    EXPECT_EQ(result_.dropped, 0U);
    EXPECT_EQ(result_.messages, 3U * ticks);
    ASSERT_EQ(file.of("/a").size(), std::size_t{ticks});
    for (std::size_t i = 0; i < file.messages.size(); ++i)
      ASSERT_EQ(file.messages[i].log_time, i / 3 * ms) << "in the order of times";
    if (round == 0) first = folder_.read("r.mcap");
    for (const auto signal : signals)
      table_.write(signal, signals::SignalValue{});
  }
  EXPECT_TRUE(folder_.read("r.mcap") == first);
}

TEST_F(RecorderTest, FullRingDropsAndCountsInRealTime) {
  std::vector<signals::SignalId> signals;
  for (int i = 0; i < 2'000; ++i)
    signals.push_back(add("a.x" + std::to_string(i), "module a"));
  open(false);
  constexpr std::uint64_t ticks = 5'000;  // faster than the numbers can be encoded
  for (std::uint64_t tick = 0; tick < ticks; ++tick) {
    const auto time_ns = static_cast<std::int64_t>(tick) * ms;
    for (const auto signal : signals)
      table_.write(signal, static_cast<double>(tick) + 0.123456789, time_ns);
    take(time_ns);
  }
  for (std::uint32_t id = 0; id < 40'000; ++id)
    take(*recorder_->frame_sink("can.car"), {.time_ns = 0, .id = id});
  const test::ReadMcap file = close();
  EXPECT_GT(result_.dropped, 0U);
  EXPECT_EQ(result_.messages + result_.dropped, ticks + 40'000);
  EXPECT_EQ(file.metadata.at("recording").at("dropped"), std::to_string(result_.dropped));
  std::uint64_t before = 0;
  for (const test::ReadMessage& message : file.of("/a")) {
    ASSERT_TRUE(message.log_time == 0 || message.log_time > before);
    before = message.log_time;
    const std::uint64_t tick = before / ms;
    ASSERT_EQ(Json::parse(message.data)["x1999"].get<double>(), static_cast<double>(tick) + 0.123456789);
  }
}

TEST_F(RecorderTest, TakingATickDoesNotAllocate) {
  const auto signal = add("a.x", "module a"), arriving = add("can.car.M.v", "can.car", true);
  open(false);
  io::FrameSink& sink = *recorder_->frame_sink("can.car");
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int tick = 0; tick < 20'000; ++tick) {
    table_.write(signal, tick, tick * ms);
    table_.write(arriving, {.value = 1.0, .time_ns = tick, .fresh = true});
    take(tick * ms);
    take(sink, {.time_ns = tick * ms, .id = 1});
  }
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

TEST_F(RecorderTest, WritesDuringTheRun) {
  std::vector<signals::SignalId> signals;
  for (int i = 0; i < 200; ++i)
    signals.push_back(add("a.x" + std::to_string(i), "module a"));
  open(false);
  const auto at_begin = std::filesystem::file_size(file_);
  for (int tick = 0; tick < 2'000; ++tick) {
    for (const auto signal : signals)
      table_.write(signal, tick * 0.1, tick * ms);
    take(tick * ms);
  }
  EXPECT_TRUE(tests::eventually([&] { return std::filesystem::file_size(file_) > at_begin + 10'000; }));
}

TEST_F(RecorderTest, StopsAtItsLargestSizeAndSaysWhen) {
  const auto signal = add("a.x", "module a"), other = add("b.x", "module b");
  open(true, Recorder::min_bytes);
  double value = 0.5;
  constexpr int ticks = 200'000;
  for (int tick = 0; tick < ticks; ++tick) {
    value = std::fmod(value * 3.9 * (1.0 - value) + 1e-9, 1.0);
    table_.write(signal, value, tick * ms);
    table_.write(other, value * value, tick * ms);
    take(tick * ms);
  }
  std::vector<RecordedEvent> events;
  for (int i = 0; i < 100; ++i)
    events.push_back({i * ms, "event " + std::to_string(i)});
  const test::ReadMcap file = close(events);
  EXPECT_LE(result_.bytes, Recorder::min_bytes);
  EXPECT_GT(result_.bytes, Recorder::min_bytes * 8 / 10);
  EXPECT_EQ(file.of("/events").size(), 100U) << "there is space for events";
  ASSERT_TRUE(result_.stopped_at_ns);
  EXPECT_GT(*result_.stopped_at_ns, 1'000 * ms);
  EXPECT_LT(*result_.stopped_at_ns, (ticks - 1'000) * ms);
  EXPECT_EQ(result_.messages + result_.not_recorded, 2U * ticks + 100);
  for (const test::ReadMessage& message : file.of("/a"))
    ASSERT_LE(message.log_time, static_cast<std::uint64_t>(*result_.stopped_at_ns));
  EXPECT_EQ(file.metadata.at("recording").at("not_recorded"), std::to_string(result_.not_recorded));
  EXPECT_TRUE(file.metadata.at("recording").contains("stopped_at_s"));
}

TEST_F(RecorderTest, TooManyEventsForTheSizeAreCounted) {
  open(true, Recorder::min_bytes);
  std::vector<RecordedEvent> events;
  for (int i = 0; i < 30'000; ++i) {
    std::string noise;
    for (int k = 0; k < 100; ++k)
      noise += static_cast<char>('!' + (i * 7919 + k * k * 104'729 + (i % 251) * (k % 83)) % 90);
    events.push_back({i * ms, noise});
  }
  close(events);
  ASSERT_TRUE(result_.stopped_at_ns);
  EXPECT_GT(result_.not_recorded, 0U);
  EXPECT_LE(result_.bytes, Recorder::min_bytes);
  EXPECT_EQ(result_.messages + result_.not_recorded, 30'000U);
}

TEST_F(RecorderTest, TopicsThatDoNotFitAreRefused) {
  for (int i = 0; i < 20'000; ++i)
    add("a.a_long_name_of_a_signal_" + std::to_string(i), "module a");
  try {
    open(true, Recorder::min_bytes);
    FAIL() << "no error";
  } catch (const io::DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("do not fit into 'max_size'"), std::string::npos)
        << error.what();
  }
}

TEST_F(RecorderTest, FullDiskIsReported) {
  add("a.x", "module a");
  Recorder recorder({.file = "/dev/full",
                     .max_bytes = Recorder::min_bytes,
                     .virtual_clock = true,
                     .frame_buses = {},
                     .about_run = {}},
                    table_, all_);
  recorder.take(table_, 0);
  EXPECT_EQ(recorder.close({}, {}).fault,
            "/dev/full could not be written completely: No space left on device");
}

}  // namespace
}  // namespace hil::recording
