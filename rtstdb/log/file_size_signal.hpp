#pragma once
// A file that would pass the size that the process may write (RLIMIT_FSIZE, `ulimit -f`): the kernel refuses the call with EFBIG, and
// sends the thread SIGXFSZ besides, which ends the program that expects none. A library has to hear of it by the call alone.

#include <csignal>
#include <ctime>

namespace rtstdb::log {

/// Within its life this thread does not get the signal. One that was sent meanwhile is dropped, unless the thread had it blocked before.
class FileSizeSignalBlocked {
 public:
  FileSizeSignalBlocked() noexcept {
    sigemptyset(&signal_);
    sigaddset(&signal_, SIGXFSZ);
    pthread_sigmask(SIG_BLOCK, &signal_, &before_);
  }
  ~FileSizeSignalBlocked() {
    if (sigismember(&before_, SIGXFSZ) == 1) return;
    const timespec at_once{};
    sigtimedwait(&signal_, nullptr, &at_once);
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  FileSizeSignalBlocked(const FileSizeSignalBlocked&) = delete;
  FileSizeSignalBlocked& operator=(const FileSizeSignalBlocked&) = delete;

 private:
  sigset_t signal_{}, before_{};
};

}  // namespace rtstdb::log
