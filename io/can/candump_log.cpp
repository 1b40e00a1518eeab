#include "io/can/candump_log.hpp"

#include <fcntl.h>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>

namespace hil::io::can {

namespace {

constexpr std::chrono::milliseconds gathering_time{5};

}  // namespace

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
