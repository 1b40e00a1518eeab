#include "runtime/cli/flush_output.hpp"

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>

#include "runtime/run/session.hpp"

namespace hil::cli {

int flush_output(const char* command, int exit_code) {
  errno = 0;
  const bool sent = std::fflush(stdout) == 0;
  if (sent && std::ferror(stdout) == 0) return exit_code;
  // A write that failed before this call has left no errno.
  const std::string reason = errno == 0 ? "" : std::string(": ") + std::strerror(errno);
  std::fprintf(stderr, "hil %s: the output can not be written%s\n", command, reason.c_str());
  return exit_code == run::exit_passed ? run::exit_io_failed : exit_code;
}

}  // namespace hil::cli
