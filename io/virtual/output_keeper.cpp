#include "io/virtual/output_keeper.hpp"

#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <sys/eventfd.h>
#include <sys/stat.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <string_view>
#include <system_error>

namespace hil::io::process {

namespace {

constexpr std::size_t bytes_at_once = 65536;  // a pipe's usual capacity
// Output read at the end from processes that still run
constexpr std::size_t bytes_at_end = bytes_at_once * 16;
constexpr std::string_view rest_left_out =
    "\n[hil: this program printed more than 16 MiB; the rest was left out]\n";

}  // namespace

OutputKeeper::OutputKeeper(const std::filesystem::path& file)
    : file_name_(file.string()),
      file_(::open(file.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_APPEND | O_CLOEXEC, 0644)) {
  if (file_.get() < 0) return;
  std::array<int, 2> ends{-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;
  from_ = Descriptor(ends[0]);
  // The child's end stays blocking, as programs expect.
  if (::fcntl(from_.get(), F_SETFL, O_NONBLOCK) != 0) return;
  wake_ = Descriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (wake_.get() < 0) {
    ::close(ends[1]);
    return;
  }
  into_ = Descriptor(ends[1]);
}

bool OutputKeeper::begin() {
  into_.reset();
  try {
    thread_ = std::thread([this] { serve(); });
  } catch (const std::system_error& error) {
    errno = error.code().value();
    return false;
  }
  return true;
}

void OutputKeeper::finish() noexcept {
  if (!thread_.joinable()) return;
  finishing_.store(true);
  static_cast<void>(::eventfd_write(wake_.get(), 1));
  thread_.join();
  struct stat state {};
  was_cut_ = ::fstat(file_.get(), &state) == 0 && S_ISREG(state.st_mode) &&
             static_cast<std::uint64_t>(state.st_size) != written_;
  file_.reset();
  from_.reset();
}

std::string OutputKeeper::fault() const {
  if (write_error_ == 0 && was_cut_)
    return "the output of a program in '" + file_name_ + "' was changed by another program";
  if (write_error_ == 0) return {};
  return "the output of a program can not be written whole to '" + file_name_ +
         "': " + std::generic_category().message(write_error_);
}

void OutputKeeper::serve() noexcept {
  ::pthread_setname_np(::pthread_self(), "process output");
  while (!finishing_.load()) {
    std::array<pollfd, 2> watched{pollfd{from_.get(), POLLIN, 0}, pollfd{wake_.get(), POLLIN, 0}};
    static_cast<void>(::poll(watched.data(), watched.size(), -1));
    if (!take(bytes_at_once)) return;
  }
  take(bytes_at_end);
}

bool OutputKeeper::take(std::size_t max_bytes) noexcept {
  std::array<char, bytes_at_once> bytes;
  for (std::size_t taken = 0; taken < max_bytes;) {
    const ssize_t count = ::read(from_.get(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno == EAGAIN;
    if (count == 0) return false;
    keep(bytes.data(), static_cast<std::size_t>(count));
    taken += static_cast<std::size_t>(count);
  }
  return true;
}

void OutputKeeper::keep(const char* bytes, std::size_t count) noexcept {
  const auto write_all = [this](std::string_view text) {
    while (!text.empty()) {
      const ssize_t written = ::write(file_.get(), text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written <= 0) {  // if the disk is full the rest is discarded and the child continues
        if (write_error_ == 0) write_error_ = written < 0 ? errno : EIO;
        return;
      }
      written_ += static_cast<std::uint64_t>(written);
      text.remove_prefix(static_cast<std::size_t>(written));
    }
  };
  const std::size_t kept = std::min(count, remaining_bytes_);
  remaining_bytes_ -= kept;
  write_all({bytes, kept});
  if (kept == count || left_out_) return;
  left_out_ = true;
  write_all(rest_left_out);
}

}  // namespace hil::io::process
