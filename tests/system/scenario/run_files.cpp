#include "tests/system/scenario/run_files.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "io/can/signal_codec.hpp"
#include "tests/paths.h"
#include "tests/system/scenario/hil.hpp"

namespace hil::scenario_test {
namespace {

/// A cell in quotes may contain commas.
std::vector<std::string> cells(const std::string& line) {
  std::vector<std::string> result{""};
  bool is_in_quotes = false;
  for (const char c : line) {
    if (c == '"')
      is_in_quotes = !is_in_quotes;
    else if (c == ',' && !is_in_quotes)
      result.emplace_back();
    else
      result.back() += c;
  }
  return result;
}

double number(const std::string& cell) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  EXPECT_TRUE(error == std::errc() && end == cell.data() + cell.size()) << "'" << cell << "' is no number";
  return value;
}

}  // namespace

nlohmann::json read_report(const std::filesystem::path& directory) {
  nlohmann::json report = nlohmann::json::parse(read_text(directory / "report.json"), nullptr, false);
  EXPECT_FALSE(report.is_discarded()) << directory;
  return report;
}

std::string events_in_ms(const nlohmann::json& report) {
  std::string events;
  for (const auto& event : report["events"])
    events += std::to_string(event["time_ns"].get<std::int64_t>() / 1'000'000) + " " +
              event["text"].get<std::string>() + "\n";
  return events;
}

Signals::Signals(const std::filesystem::path& directory) {
  std::istringstream stream(read_text(directory / "signals.csv"));
  std::string line;
  EXPECT_TRUE(std::getline(stream, line));
  const std::vector<std::string> names = cells(line);
  while (std::getline(stream, line)) {
    const std::vector<std::string> row = cells(line);
    EXPECT_EQ(row.size(), names.size()) << "row " << rows_;
    for (std::size_t i = 0; i < std::min(row.size(), names.size()); ++i)
      columns_[names[i]].push_back(number(row[i]));
    ++rows_;
  }
}

const std::vector<double>& Signals::operator[](const std::string& name) const {
  static const std::vector<double> none;
  const auto found = columns_.find(name);
  if (found != columns_.end()) return found->second;
  ADD_FAILURE() << "signals.csv has no rows of '" << name << "'";
  return none;
}

std::vector<io::can::LoggedFrame> read_can_log(const std::filesystem::path& file) {
  io::can::CandumpLog log = io::can::read_candump_log(file);
  EXPECT_EQ(log.fault, "");
  EXPECT_TRUE(log.bad_lines.empty()) << file << ":" << log.bad_lines.front();
  EXPECT_FALSE(log.frames.empty()) << file;
  return std::move(log.frames);
}

std::vector<double> values_on_bus(const std::vector<io::can::LoggedFrame>& frames, const std::string& name) {
  static const io::can::DbcResult database =
      io::can::load_dbc(std::string(HIL_SOURCE_DIR) + "/configs/crossing/crossing.dbc");
  const std::size_t dot = name.find('.');
  const io::can::DbcMessage* message = database.database.find_message(name.substr(0, dot));
  const io::can::DbcSignal* signal =
      message != nullptr ? message->find_signal(name.substr(dot + 1)) : nullptr;
  std::vector<double> values;
  EXPECT_NE(signal, nullptr) << name;
  if (signal == nullptr) return values;
  const io::can::SignalCodec codec(*signal);
  for (const io::can::LoggedFrame& logged : frames) {
    if (logged.frame.identifier() == message->id) values.push_back(codec.decode(logged.frame.payload()));
  }
  return values;
}

double greatest(const std::vector<double>& values) {
  return values.empty() ? 0.0 : *std::ranges::max_element(values);
}

}  // namespace hil::scenario_test
