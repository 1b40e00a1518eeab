#include "io/virtual/process.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sched.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>

#include "io/can/assertion.hpp"

namespace hil::io::process {

namespace {

std::string program_of(const ChildConfig& config) {
  const std::string& program = config.command.front();
  if (program.find('/') != std::string::npos) return program;
  std::string found = find_program(program, config.search_folders);
  if (!found.empty()) return found;
  std::string text = "process '" + config.name + "': no program '" + program + "' was found";
  for (const auto& folder : config.search_folders)
    text += ", not in '" + folder.string() + "'";
  throw DeviceError(text + ", not in PATH; write its path, or install it");
}

/// What the child needs, prepared before fork: between fork and exec nothing may allocate.
struct Launch {
  const char* program;
  char* const* arguments;
  const char* working_folder;  ///< null: unchanged
  int output;
  int report;  ///< receives errno of the failed step; closed by a successful exec
  pid_t parent;
};

[[noreturn]] void become_program(const Launch& launch) noexcept {
  const auto fail = [&] {
    const int error = errno;
    static_cast<void>(::write(launch.report, &error, sizeof error));
    ::_exit(127);
  };
  if (::prctl(PR_SET_PDEATHSIG, SIGKILL) != 0) fail();
  if (::getppid() != launch.parent) ::_exit(127);  // the parent died before PR_SET_PDEATHSIG took effect
  static_cast<void>(::setpgid(0, 0));
  for (int signal = 1; signal < NSIG; ++signal)
    ::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const sched_param ordinary{};
  static_cast<void>(::sched_setscheduler(0, SCHED_OTHER, &ordinary));
  const int input = ::open("/dev/null", O_RDONLY | O_CLOEXEC);
  if (input < 0 || ::dup2(input, STDIN_FILENO) < 0) fail();
  if (::dup2(launch.output, STDOUT_FILENO) < 0 || ::dup2(launch.output, STDERR_FILENO) < 0) fail();
  if (launch.working_folder != nullptr && ::chdir(launch.working_folder) != 0) fail();
  ::execv(launch.program, launch.arguments);
  fail();
  ::_exit(127);
}

/// Waits in the group of a child, and kills that group when `watched` has no writer left, which means that
/// this process has ended. The child itself then dies by PR_SET_PDEATHSIG, but the processes that it started
/// do not. This runs a shell, since a plain fork would share this process's memory and slow down its first
/// write to each page.
[[noreturn]] void become_guardian(int watched, pid_t group) noexcept {
  if (::setpgid(0, group) != 0) ::_exit(0);  // the child no longer leads the group
  for (int signal = 1; signal < NSIG; ++signal)
    ::signal(signal, SIG_IGN);  // signals sent to the group also reach the guardian
  sigset_t none;
  sigemptyset(&none);
  ::sigprocmask(SIG_SETMASK, &none, nullptr);
  const sched_param ordinary{};
  static_cast<void>(::sched_setscheduler(0, SCHED_OTHER, &ordinary));
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  if (nowhere < 0 || ::chdir("/") != 0) ::_exit(127);
  if (::dup2(watched, STDIN_FILENO) < 0 || ::dup2(nowhere, STDOUT_FILENO) < 0 ||
      ::dup2(nowhere, STDERR_FILENO) < 0) {
    ::_exit(127);
  }
  ::execl("/bin/sh", "sh", "-c", "read -r nothing; kill -KILL 0", "hil-guardian", nullptr);
  ::_exit(127);
}

/// Waits for the end of a child and returns its status.
int collect(pid_t pid) noexcept {
  int status = 0;
  while (::waitpid(pid, &status, 0) < 0 && errno == EINTR) {
  }
  return status;
}

}  // namespace

std::string find_program(const std::string& name, std::vector<std::filesystem::path> folders) {
  const char* const path = std::getenv("PATH");
  std::string rest = path == nullptr ? "/usr/local/bin:/usr/bin:/bin" : path;
  while (!rest.empty()) {
    const std::size_t colon = rest.find(':');
    folders.emplace_back(rest.substr(0, colon));
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
  }
  for (const auto& folder : folders) {
    std::string candidate = (folder / name).string();
    if (::access(candidate.c_str(), X_OK) == 0 && !std::filesystem::is_directory(candidate)) return candidate;
  }
  return {};
}

std::string describe(const Exit& exit) {
  if (exit.how == Exit::How::exited) return "exited with code " + std::to_string(exit.code);
  return "was ended by signal " + std::to_string(exit.code) + " (" + ::strsignal(exit.code) + ")";
}

Child::Child(const ChildConfig& config) : name_(config.name) {
  can::require(!config.command.empty() && !config.command.front().empty(), "a process has a command");
  const auto refuse = [&](const std::string& what, int error) {
    throw DeviceError("process '" + config.name + "': " + what + ": " + std::strerror(error));
  };
  const std::string program = program_of(config);
  std::vector<std::string> words = config.command;
  std::vector<char*> arguments;
  arguments.reserve(words.size() + 1);
  for (std::string& word : words)
    arguments.push_back(word.data());
  arguments.push_back(nullptr);
  const std::string folder = config.working_folder.string();
  Descriptor nowhere;
  if (config.output_file.empty()) {
    nowhere = Descriptor(::open("/dev/null", O_WRONLY | O_CLOEXEC));
    if (nowhere.get() < 0) refuse("'/dev/null' can not be written", errno);
  } else {
    output_ = std::make_unique<OutputKeeper>(config.output_file);
    if (!output_->open()) {
      refuse("its output file '" + config.output_file.string() + "' can not be written", errno);
    }
  }
  std::array<int, 2> report{-1, -1};
  if (::pipe2(report.data(), O_CLOEXEC) != 0) refuse("can not be started: pipe", errno);
  const Descriptor report_in(report[0]);
  Descriptor report_out(report[1]);

  const Launch launch{program.c_str(),
                      arguments.data(),
                      folder.empty() ? nullptr : folder.c_str(),
                      output_ ? output_->input_fd() : nowhere.get(),
                      report_out.get(),
                      ::getpid()};
  pid_ = ::fork();
  if (pid_ < 0) refuse("can not be started: fork", errno);
  if (pid_ == 0) become_program(launch);
  report_out.reset();
  int error = 0;
  ssize_t got = 0;
  while ((got = ::read(report_in.get(), &error, sizeof error)) < 0 && errno == EINTR) {
  }
  if (got == 0) pidfd_ = Descriptor(static_cast<int>(::syscall(SYS_pidfd_open, pid_, 0)));
  if (pidfd_.get() >= 0 && start_guardian() && (!output_ || output_->begin())) return;
  const int reason = got == 0 ? errno : error;
  for (const pid_t started : {pid_, guardian_}) {
    if (started <= 0) continue;
    ::kill(started, SIGKILL);
    collect(started);
  }
  refuse("'" + program + "' can not be run", reason);
}

Child::~Child() {
  stop(1'000'000'000);
}

bool Child::start_guardian() {
  std::array<int, 2> ends{-1, -1};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return false;
  const Descriptor watched(ends[0]);
  guardian_pipe_ = Descriptor(ends[1]);
  guardian_ = ::fork();
  if (guardian_ == 0) become_guardian(watched.get(), pid_);
  return guardian_ > 0;
}

bool Child::try_collect() {
  if (ended_) return true;
  siginfo_t ended{};
  if (::waitid(P_PID, static_cast<id_t>(pid_), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
      ended.si_pid != pid_) {
    return false;
  }
  signal_group(SIGKILL);       // remaining processes of the group, before the group's number can be reused
  ::kill(guardian_, SIGKILL);  // not in the group if the child had left it
  const int status = collect(pid_);
  collect(guardian_);
  if (output_) output_->finish();
  ended_ = true;
  exit_.how = WIFEXITED(status) ? Exit::How::exited : Exit::How::killed;
  exit_.code = WIFEXITED(status) ? WEXITSTATUS(status) : WTERMSIG(status);
  return true;
}

bool Child::wait_for_exit(std::int64_t limit_ns) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::nanoseconds(limit_ns);
  while (!try_collect()) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(end - std::chrono::steady_clock::now());
    if (left.count() <= 0) return false;
    pollfd watched{pidfd_.get(), POLLIN, 0};
    static_cast<void>(::poll(&watched, 1, static_cast<int>(std::min<std::int64_t>(left.count(), 1'000'000))));
  }
  return true;
}

const Exit& Child::stop(std::int64_t limit_ns) {
  if (try_collect()) return exit_;
  signal_group(SIGTERM);
  if (wait_for_exit(limit_ns)) return exit_;
  exit_.had_to_be_killed = true;
  signal_group(SIGKILL);
  while (!wait_for_exit(1'000'000'000)) {
  }
  return exit_;
}

const Exit& Child::exit() const {
  can::require(ended_, "only a process that has ended has an exit");
  return exit_;
}

void Child::signal_group(int signal) const noexcept {
  ::kill(-pid_, signal);
}

}  // namespace hil::io::process
