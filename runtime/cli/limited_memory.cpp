#include "runtime/cli/limited_memory.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>

#include "runtime/report/quantities.hpp"
#include "runtime/run/session.hpp"

namespace hil::cli {
namespace {

struct Limit {
  decltype(RLIMIT_AS) resource;
  const char* what;
  const char* command;
};

constexpr std::array limits{Limit{RLIMIT_AS, "the address space", "ulimit -v"},
                            Limit{RLIMIT_DATA, "the data", "ulimit -d"}};

/// A limit below this many threads of one user may be too low for a run. The limit does not apply to root.
constexpr rlim_t few_threads = 1024;

/// The driver of a GPU needs less than this to open.
constexpr std::size_t scarce_bytes = std::size_t{1} << 30;

constexpr std::array ending_signals{SIGINT, SIGTERM, SIGHUP};

volatile sig_atomic_t child_process = 0;

rlim_t limit_of(const Limit& limit) {
  rlimit value{};
  return getrlimit(limit.resource, &value) == 0 ? value.rlim_cur : RLIM_INFINITY;
}

bool is_memory_limited() {
  for (const Limit& limit : limits)
    if (limit_of(limit) != RLIM_INFINITY) return true;
  return false;
}

/// Forwards signals that a program sends, since they reach this process alone. A terminal sends its signals
/// to the child too.
void pass_on(int signal, siginfo_t* information, void* /*context*/) {
  if (information->si_code <= 0 && child_process > 0) kill(child_process, signal);
}

void pass_signals_on() {
  struct sigaction action {};
  action.sa_sigaction = pass_on;
  action.sa_flags = SA_SIGINFO | SA_RESTART;
  for (const int signal : ending_signals) {
    struct sigaction before {};
    if (sigaction(signal, nullptr, &before) == 0 && before.sa_handler != SIG_IGN)
      sigaction(signal, &action, nullptr);
  }
}

/// Writes the exit code to the pipe once the work is complete. The exit code of the process alone is not
/// reliable, since drivers call exit() too.
int work_as_child(const std::function<int()>& work, int pipe_end) {
  try {
    const int exit_code = work();
    const auto byte = static_cast<unsigned char>(exit_code);
    if (write(pipe_end, &byte, 1) != 1) _exit(run::exit_internal);
    return exit_code;
  } catch (const std::exception&) {
    _exit(run::exit_internal);
  }
}

std::string end_in_words(int status) {
  if (WIFSIGNALED(status)) {
    return "was ended by signal " + std::to_string(WTERMSIG(status)) + " (" + strsignal(WTERMSIG(status)) +
           ")";
  }
  return "ended with exit code " + std::to_string(WEXITSTATUS(status)) + " before its work was complete";
}

int wait_for(pid_t child, int pipe_end, const std::function<int(const std::string&)>& report_end) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  unsigned char exit_code = 0;
  const bool is_complete = read(pipe_end, &exit_code, 1) == 1;
  close(pipe_end);
  if (is_complete) return exit_code;
  const int signal_number = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  if (std::find(ending_signals.begin(), ending_signals.end(), signal_number) != ending_signals.end()) {
    std::signal(signal_number, SIG_DFL);  // the sender means this process, too
    std::raise(signal_number);
  }
  return report_end(end_in_words(status));
}

}  // namespace

std::string memory_advice() {
  std::string sentence;
  for (const Limit& limit : limits) {
    const rlim_t bytes = limit_of(limit);
    if (bytes == RLIM_INFINITY) continue;
    sentence += std::string(sentence.empty() ? "" : ", ") + limit.what + " of a process is limited to " +
                report::bytes_text(bytes) + " (" + limit.command + ")";
  }
  rlimit threads{};
  if (geteuid() != 0 && getrlimit(RLIMIT_NPROC, &threads) == 0 && threads.rlim_cur < few_threads) {
    sentence += std::string(sentence.empty() ? "" : ", ") +
                "processes and threads of this user are limited to " + std::to_string(threads.rlim_cur) +
                " (ulimit -u)";
  }
  if (sentence.empty()) return "make memory free, or the scenario smaller";
  return sentence + "; raise the limit or remove it";
}

bool is_memory_scarce() {
  if (!is_memory_limited()) return false;
  void* const memory =
      mmap(nullptr, scarce_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (memory == MAP_FAILED) return true;
  munmap(memory, scarce_bytes);
  return false;
}

int run_within_limits(const std::function<int()>& work,
                      const std::function<int(const std::string& end)>& report_end) {
  std::array<int, 2> ends{};
  if (!is_memory_limited() || pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK) != 0) return work();
  std::fflush(nullptr);
  sigset_t ending, before;
  sigemptyset(&ending);
  for (const int signal : ending_signals)
    sigaddset(&ending, signal);
  sigprocmask(SIG_BLOCK, &ending, &before);
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(run::exit_internal);
    close(ends[0]);
    sigprocmask(SIG_SETMASK, &before, nullptr);
    return work_as_child(work, ends[1]);
  }
  const std::string refusal = std::strerror(errno);
  close(ends[1]);
  child_process = child;
  if (child > 0) pass_signals_on();
  sigprocmask(SIG_SETMASK, &before, nullptr);
  if (child > 0) return wait_for(child, ends[0], report_end);
  close(ends[0]);
  return report_end("can not start its child process: " + refusal);
}

}  // namespace hil::cli
