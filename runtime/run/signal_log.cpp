#include "runtime/run/signal_log.hpp"

#include <charconv>
#include <chrono>
#include <system_error>

#include "io/device.hpp"

namespace hil::run {
namespace {

void append_number(std::string& text, double value) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  text.append(digits, end);
}

/// Seconds with nine decimals, exact.
void append_time(std::string& text, std::int64_t time_ns) {
  char digits[32];
  const auto end = std::to_chars(digits, digits + sizeof digits, time_ns / 1'000'000'000).ptr;
  text.append(digits, end);
  std::string decimals = std::to_string(time_ns % 1'000'000'000);
  text += '.' + std::string(9 - decimals.size(), '0') + decimals;
}

/// A name as a cell of the first line: in quotes where it contains a comma, as those of relations do.
std::string cell(const std::string& name) {
  if (name.find_first_of(",\"") == std::string::npos) return name;
  std::string quoted = "\"";
  for (const char c : name)
    quoted.append(c == '"' ? 2 : 1, c);
  return quoted + '"';
}

}  // namespace

SignalLog::SignalLog(const std::filesystem::path& file, const signals::SignalTable& table, bool virtual_clock)
    : path_(file),
      columns_(table.size()),
      virtual_clock_(virtual_clock),
      ring_(ring_rows * columns_),
      times_ns_(ring_rows),
      file_(file) {
  file_.close();
  file_.open(file, std::ios::app);
  if (!file_) throw io::DeviceError(file.string() + " can not be written");
  text_ = "time_s";
  for (std::uint32_t i = 0; i < columns_; ++i)
    text_ += ',' + cell(table.info({i}).name);
  text_ += '\n';
  write_text();
  if (!virtual_clock_) thread_ = std::thread([this] { serve(); });
}

SignalLog::~SignalLog() {
  close();
}

void SignalLog::take(const signals::SignalTable& table, std::int64_t time_ns) noexcept {
  const std::uint64_t place = written_.load(std::memory_order_relaxed);
  if (place - read_.load(std::memory_order_acquire) == ring_rows) {
    if (!virtual_clock_) {
      lost_.fetch_add(1, std::memory_order_relaxed);
      return;
    }
    drain();
  }
  double* row = ring_.data() + (place % ring_rows) * columns_;
  const auto values = table.values();
  for (std::size_t i = 0; i < columns_; ++i)
    row[i] = values[i].value;
  times_ns_[place % ring_rows] = time_ns;
  written_.store(place + 1, std::memory_order_release);
}

void SignalLog::write_text() {
  file_ << text_;
  bytes_ += text_.size();
}

void SignalLog::drain() {
  const std::uint64_t end = written_.load(std::memory_order_acquire);
  for (std::uint64_t place = read_.load(std::memory_order_relaxed); place < end; ++place) {
    text_.clear();
    append_time(text_, times_ns_[place % ring_rows]);
    const double* row = ring_.data() + (place % ring_rows) * columns_;
    for (std::size_t i = 0; i < columns_; ++i) {
      text_ += ',';
      append_number(text_, row[i]);
    }
    text_ += '\n';
    write_text();
    read_.store(place + 1, std::memory_order_release);
  }
}

void SignalLog::serve() {
  while (!stopping_.load(std::memory_order_acquire)) {
    drain();
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
}

std::string SignalLog::close() {
  stopping_.store(true, std::memory_order_release);
  if (thread_.joinable()) thread_.join();
  if (!file_.is_open()) return {};
  drain();
  file_.close();
  if (!file_) return path_.string() + " could not be written completely";
  std::error_code error;
  const bool was_cut =
      std::filesystem::is_regular_file(path_, error) && std::filesystem::file_size(path_, error) != bytes_;
  return was_cut ? path_.string() + " was changed by another program while the run wrote it" : std::string();
}

}  // namespace hil::run
