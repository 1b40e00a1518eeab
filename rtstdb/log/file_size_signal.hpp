#pragma once
// A write beyond the process's file size limit (RLIMIT_FSIZE, `ulimit -f`) fails with EFBIG and also sends
// SIGXFSZ to the thread, which ends a program that does not handle it. A library must report the error only
// by the failed call.

#include <csignal>
#include <ctime>

namespace rtstdb::log {

/// Blocks SIGXFSZ for the calling thread during its lifetime. A signal sent in that time is discarded, unless
/// the thread had it blocked before.
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
