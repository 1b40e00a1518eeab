#include "programs.hpp"

#include <fcntl.h>
#include <poll.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>

namespace hil::io::modbus::test {

CommandResult run_command(const std::string& command) {
  CommandResult result;
  FILE* pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return result;
  std::array<char, 512> text{};
  while (std::fgets(text.data(), text.size(), pipe) != nullptr)
    result.output += text.data();
  const int status = ::pclose(pipe);
  result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return result;
}

CommandResult mbpoll(std::uint16_t port, const std::string& options, const std::string& values) {
  return run_command("mbpoll -m tcp -a 1 -0 -1 -q -o 5 -p " + std::to_string(port) + " " + options +
                     " 127.0.0.1 " + values);
}

Process::Process(const std::vector<std::string>& command) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return;
  output_ = Descriptor(ends[0]);
  const Descriptor write_end(ends[1]);
  std::vector<char*> arguments;
  arguments.reserve(command.size() + 1);
  for (const std::string& word : command)
    arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  pid_ = ::fork();
  if (pid_ == 0) {
    ::dup2(write_end.get(), STDOUT_FILENO);
    ::execvp(arguments[0], arguments.data());
    ::_exit(127);
  }
  pollfd wanted{output_.get(), POLLIN, 0};
  while (::poll(&wanted, 1, 10'000) > 0) {
    char letter = 0;
    // The write end is still open here, so the end of a child that died shows as the time-out.
    if (::read(output_.get(), &letter, 1) != 1 || letter == '\n') break;
    first_line_ += letter;
  }
}

Process::~Process() {
  kill();
}

std::uint16_t Process::port() const {
  const std::size_t colon = first_line_.rfind(':');
  if (colon == std::string::npos) return 0;
  return static_cast<std::uint16_t>(std::strtoul(first_line_.c_str() + colon + 1, nullptr, 10));
}

void Process::kill() {
  if (pid_ <= 0) return;
  ::kill(pid_, SIGKILL);
  ::waitpid(pid_, nullptr, 0);
  pid_ = -1;
}

int Process::terminate() {
  ::kill(pid_, SIGTERM);
  int status = 0;
  ::waitpid(pid_, &status, 0);
  pid_ = -1;
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

}  // namespace hil::io::modbus::test
