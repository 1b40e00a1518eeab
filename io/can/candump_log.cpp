#include "io/can/candump_log.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <chrono>
#include <cstring>
#include <fstream>

namespace hil::io::can {

namespace {

constexpr std::string_view hex_digits = "0123456789ABCDEF";
constexpr std::chrono::milliseconds gathering_time{5};
constexpr std::int64_t ns_per_second = 1'000'000'000;

void append_hex(std::string& text, std::uint32_t value, int digits) {
  for (int shift = 4 * (digits - 1); shift >= 0; shift -= 4) {
    text.push_back(hex_digits[(value >> static_cast<unsigned>(shift)) & 0xFU]);
  }
}

int hex_value(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

bool parse_time(std::string_view& line, std::int64_t& time_ns) {
  const std::size_t close = line.find(") ");
  if (line.empty() || line.front() != '(' || close == std::string_view::npos) return false;
  const std::string_view text = line.substr(1, close - 1);
  const std::size_t dot = text.find('.');
  if (dot == std::string_view::npos || text.size() - dot - 1 != 6) return false;
  std::int64_t seconds = 0;
  std::uint32_t microseconds = 0;
  const char* const end = text.data() + text.size();
  const auto whole = std::from_chars(text.data(), text.data() + dot, seconds);
  const auto part = std::from_chars(text.data() + dot + 1, end, microseconds);
  if (whole.ec != std::errc{} || whole.ptr != text.data() + dot || part.ec != std::errc{} || part.ptr != end)
    return false;
  if (seconds < 0 || seconds > INT64_MAX / ns_per_second - 1) return false;
  time_ns = seconds * ns_per_second + std::int64_t{microseconds} * 1000;
  line.remove_prefix(close + 2);
  return true;
}

bool parse_identifier(std::string_view text, canid_t& can_id) {
  if (text.size() != 3 && text.size() != 8) return false;
  const auto [stop, fault] = std::from_chars(text.data(), text.data() + text.size(), can_id, 16);
  if (fault != std::errc{} || stop != text.data() + text.size()) return false;
  if (text.size() == 3) return can_id <= CAN_SFF_MASK;
  if ((can_id & CAN_ERR_FLAG) == 0) can_id |= CAN_EFF_FLAG;
  return (can_id & CAN_RTR_FLAG) == 0;
}

/// Removes the suffix `_C` of a classic frame of 8 bytes, where C is its data length code, 9 to F. False: the
/// suffix has another form.
bool take_length_code(std::string_view& text, Frame& frame) {
  const std::size_t mark = text.find('_');
  if (mark == std::string_view::npos) return true;
  const int code = text.size() == mark + 2 ? hex_value(text[mark + 1]) : -1;
  text = text.substr(0, mark);
  if (frame.is_fd || code <= CAN_MAX_DLEN) return false;
  frame.raw.__res1 = static_cast<std::uint8_t>(code);  // can_frame::len8_dlc
  return true;
}

bool parse_payload(std::string_view text, Frame& frame) {
  const std::size_t most = frame.is_fd ? CANFD_MAX_DLEN : CAN_MAX_DLEN;
  if (text.size() % 2 != 0 || text.size() / 2 > most || !valid_length(text.size() / 2, frame.is_fd))
    return false;
  for (std::size_t index = 0; index < text.size() / 2; ++index) {
    const int high = hex_value(text[2 * index]);
    const int low = hex_value(text[2 * index + 1]);
    if (high < 0 || low < 0) return false;
    frame.raw.data[index] = static_cast<std::uint8_t>(high * 16 + low);
  }
  frame.raw.len = static_cast<std::uint8_t>(text.size() / 2);
  return true;
}

bool parse_content(std::string_view text, Frame& frame) {
  const std::size_t mark = text.find('#');
  if (mark == std::string_view::npos || !parse_identifier(text.substr(0, mark), frame.raw.can_id))
    return false;
  std::string_view content = text.substr(mark + 1);
  if (!content.empty() && content.front() == '#') {
    if (content.size() < 2 || hex_value(content[1]) < 0) return false;
    frame.is_fd = true;
    frame.raw.flags = static_cast<std::uint8_t>(hex_value(content[1]));
    content.remove_prefix(2);
  }
  if (!take_length_code(content, frame)) return false;
  const bool has_length_code = !frame.is_fd && frame.raw.__res1 != 0;
  if (!frame.is_fd && !content.empty() && (content.front() == 'R' || content.front() == 'r')) {
    frame.raw.can_id |= CAN_RTR_FLAG;
    if (content.size() == 1) return !has_length_code;
    const int length = hex_value(content[1]);
    if (content.size() != 2 || length < 0 || length > CAN_MAX_DLEN) return false;
    frame.raw.len = static_cast<std::uint8_t>(length);
  } else if (!parse_payload(content, frame)) {
    return false;
  }
  return !has_length_code || frame.raw.len == CAN_MAX_DLEN;
}

}  // namespace

void append_candump_line(std::string& text, const Frame& frame, std::string_view interface) {
  std::array<char, 48> time{};
  const int length = std::snprintf(time.data(), time.size(), "(%010lld.%06lld) ",
                                   static_cast<long long>(frame.wall_ns / ns_per_second),
                                   static_cast<long long>(frame.wall_ns % ns_per_second / 1000));
  text.append(time.data(), static_cast<std::size_t>(length)).append(interface).push_back(' ');
  if (frame.is_error()) {
    append_hex(text, frame.raw.can_id & (CAN_ERR_MASK | CAN_ERR_FLAG), 8);
  } else {
    append_hex(text, frame.identifier(), frame.is_extended() ? 8 : 3);
  }
  text.push_back('#');
  if (frame.is_fd) {
    text.push_back('#');
    append_hex(text, frame.raw.flags & 0xFU, 1);
  }
  if (frame.is_remote()) {
    text.push_back('R');
    if (frame.raw.len > 0) append_hex(text, frame.raw.len, 1);
    return;
  }
  for (const std::uint8_t byte : frame.payload())
    append_hex(text, byte, 2);
}

std::optional<LoggedFrame> parse_candump_line(std::string_view line) {
  LoggedFrame logged;
  while (!line.empty() && (line.back() == '\r' || line.back() == '\n' || line.back() == ' '))
    line.remove_suffix(1);
  if (!parse_time(line, logged.frame.wall_ns)) return std::nullopt;
  logged.frame.time_ns = logged.frame.wall_ns;
  const std::size_t space = line.find(' ');
  if (space == 0 || space == std::string_view::npos) return std::nullopt;
  logged.interface = line.substr(0, space);
  line.remove_prefix(space + 1);
  const std::size_t end = line.find(' ');
  if (!parse_content(line.substr(0, end), logged.frame)) return std::nullopt;
  if (end != std::string_view::npos && line.substr(end) == " T") logged.frame.direction = Direction::tx;
  return logged;
}

CandumpLog read_candump_log(const std::filesystem::path& file) {
  CandumpLog log;
  std::ifstream stream(file);
  if (!stream) {
    log.fault = "the log '" + file.string() + "' can not be read: " + std::strerror(errno);
    return log;
  }
  std::string line;
  for (std::size_t number = 1; std::getline(stream, line); ++number) {
    if (line.empty() || line == "\r") continue;
    if (auto logged = parse_candump_line(line)) {
      log.frames.push_back(std::move(*logged));
    } else {
      log.bad_lines.push_back(number);
    }
  }
  if (stream.bad()) log.fault = "the log '" + file.string() + "' can not be read to its end";
  return log;
}

namespace {

/// Creates an empty file for appending. Null with errno when that fails.
std::FILE* open_to_append(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0666);
  return descriptor < 0 ? nullptr : ::fdopen(descriptor, "a");
}

}  // namespace

CandumpLogWriter::CandumpLogWriter(const std::filesystem::path& file, std::string interface,
                                   WhenFull when_full, std::size_t capacity)
    : file_name_(file.string()),
      interface_(std::move(interface)),
      when_full_(when_full),
      capacity_(capacity),
      stream_(open_to_append(file_name_)) {
  require(capacity_ > 0, "a log's queue has room for a frame");
  if (stream_ == nullptr) {
    throw DeviceError("the CAN log '" + file_name_ + "' can not be created: " + std::strerror(errno) +
                      "; choose another output folder or make this one writable");
  }
  waiting_.reserve(capacity_);
  thread_ = std::thread([this] { run(); });
}

void CandumpLogWriter::close() noexcept {
  if (!thread_.joinable()) return;
  {
    const std::lock_guard lock(mutex_);
    closing_ = true;
  }
  has_frames_.notify_one();
  thread_.join();
  struct stat state {};
  const bool was_cut = ::fstat(::fileno(stream_), &state) == 0 && S_ISREG(state.st_mode) &&
                       static_cast<std::uint64_t>(state.st_size) != bytes_;
  static_cast<void>(std::fclose(stream_));  // every batch was flushed and checked
  const std::lock_guard lock(mutex_);
  if (was_cut && fault_.empty())
    fault_ = "the CAN log '" + file_name_ + "' was changed by another program while the run wrote it";
}

void CandumpLogWriter::push(const Frame& frame) {
  {
    std::unique_lock lock(mutex_);
    require(!closing_, "nothing is logged after close");
    if (when_full_ == WhenFull::wait)
      space_available_.wait(lock, [this] { return waiting_.size() < capacity_; });
    if (waiting_.size() >= capacity_) {
      ++dropped_;
      return;
    }
    waiting_.push_back(frame);
    if (waiting_.size() != 1 && waiting_.size() != batch_limit())
      return;  // the writer is already awake or need not be
  }
  has_frames_.notify_one();
}

std::uint64_t CandumpLogWriter::dropped() const {
  const std::lock_guard lock(mutex_);
  return dropped_;
}

std::string CandumpLogWriter::fault() const {
  const std::lock_guard lock(mutex_);
  return fault_;
}

void CandumpLogWriter::run() {
  std::vector<Frame> batch;
  batch.reserve(capacity_);
  std::string text;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      has_frames_.wait(lock, [this] { return closing_ || !waiting_.empty(); });
      if (waiting_.empty()) return;
      // Frames arrive in bursts; writing a burst at once is cheaper than waking up for each frame.
      has_frames_.wait_for(lock, gathering_time,
                           [this] { return closing_ || waiting_.size() >= batch_limit(); });
      batch.swap(waiting_);
    }
    space_available_.notify_all();
    if (!write(batch, text)) {
      const std::lock_guard lock(mutex_);
      if (fault_.empty())
        fault_ = "the CAN log '" + file_name_ + "' can not be written: " + std::strerror(errno);
      dropped_ += batch.size();
    }
    batch.clear();
  }
}

bool CandumpLogWriter::write(const std::vector<Frame>& frames, std::string& text) {
  text.clear();
  for (const Frame& frame : frames) {
    append_candump_line(text, frame, interface_);
    text.push_back('\n');
  }
  if (std::fwrite(text.data(), 1, text.size(), stream_) != text.size() || std::fflush(stream_) != 0)
    return false;
  bytes_ += text.size();
  return true;
}

}  // namespace hil::io::can
