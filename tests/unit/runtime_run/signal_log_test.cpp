#include "runtime/run/signal_log.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <sstream>

#include "io/device.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/eventually.hpp"
#include "tests/support/temporary_folder.hpp"

namespace hil::run {
namespace {

using tests::TemporaryFolder;

constexpr std::int64_t ms = 1'000'000;

std::vector<std::string> lines(const std::string& text) {
  std::vector<std::string> result;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);)
    result.push_back(line);
  return result;
}

signals::SignalTable table_of(std::size_t size) {
  signals::SignalTable table;
  for (std::size_t i = 0; i < size; ++i)
    table.add({.name = std::string("s").append(std::to_string(i)), .unit = "", .writer = "test"});
  return table;
}

TEST(SignalLog, HasAHeaderAndARowForEachTime) {
  const TemporaryFolder folder;
  signals::SignalTable table;
  const auto speed = table.add({.name = "ego.speed", .unit = "m/s", .writer = "ego", .initial = 10.0});
  const auto light = table.add({.name = "plc.light", .unit = "", .writer = "plc"});
  SignalLog log(folder.path() / "signals.csv", table, true);
  log.take(table, 0);
  table.write(speed, 9.5, ms);
  table.write(light, 2.0, ms);
  log.take(table, ms);
  log.take(table, 12'345'678'901);
  EXPECT_EQ(log.close(), "");
  EXPECT_EQ(log.close(), "") << "may be closed again";
  EXPECT_EQ(folder.read("signals.csv"),
            "time_s,ego.speed,plc.light\n"
            "0.000000000,10,0\n"
            "0.001000000,9.5,2\n"
            "12.345678901,9.5,2\n");
}

TEST(SignalLog, FileChangedByAnotherProgramIsReported) {
  const TemporaryFolder folder;
  signals::SignalTable table = table_of(10);
  SignalLog log(folder.path() / "signals.csv", table, true);
  for (int row = 0; row < 2'000; ++row)
    log.take(table, row * ms);
  ASSERT_GT(std::filesystem::file_size(folder.path() / "signals.csv"), 10'000U);
  std::filesystem::resize_file(folder.path() / "signals.csv", 0);
  log.take(table, 2'000 * ms);
  EXPECT_NE(log.close().find("signals.csv was changed by another program"), std::string::npos);
}

TEST(SignalLog, NumbersAreReadBackExactly) {
  const TemporaryFolder folder;
  const double values[] = {0.1,
                           1.0 / 3.0,
                           1e300,
                           -1e-300,
                           5e-324,
                           std::numeric_limits<double>::max(),
                           123456789.123,
                           -0.0,
                           1e22,
                           std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()};
  signals::SignalTable table = table_of(std::size(values));
  for (std::uint32_t i = 0; i < std::size(values); ++i)
    table.write({i}, values[i], 0);
  SignalLog log(folder.path() / "signals.csv", table, true);
  log.take(table, 0);
  EXPECT_EQ(log.close(), "");
  std::istringstream row(lines(folder.read("signals.csv")).at(1));
  std::string cell;
  ASSERT_TRUE(std::getline(row, cell, ','));
  for (const double value : values) {
    ASSERT_TRUE(std::getline(row, cell, ','));
    const double back = std::strtod(cell.c_str(), nullptr);
    if (std::isnan(value)) {
      EXPECT_TRUE(std::isnan(back)) << cell;
    } else {
      EXPECT_EQ(back, value) << cell;
      EXPECT_EQ(std::signbit(back), std::signbit(value)) << cell;
    }
  }
  EXPECT_FALSE(std::getline(row, cell, ','));
  EXPECT_NE(folder.read("signals.csv").find(",0.1,"), std::string::npos);
}

TEST(SignalLog, LosesNoRowUnderTheVirtualClock) {
  const TemporaryFolder folder;
  signals::SignalTable table = table_of(3);
  SignalLog log(folder.path() / "signals.csv", table, true);
  constexpr int rows = 5'000;  // many times the size of the ring
  for (int i = 0; i < rows; ++i) {
    table.write({1}, i, i * ms);
    log.take(table, i * ms);
  }
  EXPECT_EQ(log.close(), "");
  EXPECT_EQ(log.lost_rows(), 0U);
  const auto all = lines(folder.read("signals.csv"));
  ASSERT_EQ(all.size(), rows + 1U);
  for (int i = 0; i < rows; ++i) {
    std::istringstream row(all[static_cast<std::size_t>(i) + 1]);
    std::string time, first, second;
    std::getline(row, time, ',');
    std::getline(row, first, ',');
    std::getline(row, second, ',');
    ASSERT_EQ(second, std::to_string(i));
    ASSERT_NEAR(std::strtod(time.c_str(), nullptr), i * 1e-3, 1e-12);
  }
}

TEST(SignalLog, RowsAreWrittenInOrderOrCountedAsLost) {
  const TemporaryFolder folder;
  signals::SignalTable table = table_of(20);
  SignalLog log(folder.path() / "signals.csv", table, false);
  constexpr std::uint64_t rows = 20'000;
  for (std::uint64_t i = 0; i < rows; ++i) {
    table.write({0}, static_cast<double>(i), 0);
    log.take(table, static_cast<std::int64_t>(i) * ms);
  }
  EXPECT_EQ(log.close(), "");
  const auto all = lines(folder.read("signals.csv"));
  EXPECT_EQ(all.size() - 1 + log.lost_rows(), rows);
  EXPECT_GT(all.size(), 500U);
  double before = -1.0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    const double value = std::strtod(all[i].substr(all[i].find(',') + 1).c_str(), nullptr);
    ASSERT_GT(value, before);
    before = value;
  }
}

TEST(SignalLog, TakingARowDoesNotAllocate) {
  const TemporaryFolder folder;
  signals::SignalTable table = table_of(50);
  SignalLog log(folder.path() / "signals.csv", table, false);
  allocation_guard::reset();
  allocation_guard::enter_tick();
  for (int i = 0; i < 2'000; ++i)
    log.take(table, i * ms);
  allocation_guard::leave_tick();
  EXPECT_EQ(allocation_guard::seen().total(), 0U);
}

TEST(SignalLog, WritesDuringTheRun) {
  const TemporaryFolder folder;
  signals::SignalTable table = table_of(200);
  SignalLog log(folder.path() / "signals.csv", table, false);
  for (int i = 0; i < 400; ++i)
    log.take(table, i * ms);
  EXPECT_TRUE(tests::eventually([&] { return folder.read("signals.csv").size() >= 100'000; }));
}

TEST(SignalLog, FullDiskIsReported) {
  signals::SignalTable table = table_of(100);
  SignalLog log("/dev/full", table, true);
  for (int i = 0; i < 1'000; ++i)
    log.take(table, i * ms);
  EXPECT_EQ(log.close(), "/dev/full could not be written completely");
}

TEST(SignalLog, FileThatCanNotBeCreatedIsRefusedWithItsName) {
  const TemporaryFolder folder;
  const signals::SignalTable table = table_of(1);
  try {
    SignalLog log(folder.path() / "no" / "such" / "signals.csv", table, true);
    FAIL() << "no error";
  } catch (const io::DeviceError& error) {
    EXPECT_NE(std::string(error.what()).find("signals.csv"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace hil::run
