#include "tests/system/scenario/program.hpp"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace hil::scenario_test {
namespace {

std::string whole_file(const std::filesystem::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return text.str();
}

std::filesystem::path scratch_file() {
  std::string name = ::testing::TempDir() + "/hil-stream-XXXXXX";
  const int fd = mkstemp(name.data());
  EXPECT_GE(fd, 0) << name;
  if (fd >= 0) close(fd);
  return name;
}

[[noreturn]] void become(const std::vector<std::string>& command, const Environment& environment,
                         const std::filesystem::path& output, const std::filesystem::path& errors) {
  for (const auto& [name, value] : environment)
    setenv(name.c_str(), value.c_str(), 1);
  const int nothing = open("/dev/null", O_RDONLY);
  const int out = open(output.c_str(), O_WRONLY | O_TRUNC);
  const int err = open(errors.c_str(), O_WRONLY | O_TRUNC);
  dup2(nothing, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  dup2(err, STDERR_FILENO);
  std::vector<char*> words;
  words.reserve(command.size() + 1);
  for (const std::string& word : command)
    words.push_back(const_cast<char*>(word.c_str()));
  words.push_back(nullptr);
  execvp(words[0], words.data());
  _exit(127);
}

std::vector<pid_t> children_of(pid_t pid) {
  std::vector<pid_t> children;
  std::error_code gone;
  for (const auto& thread :
       std::filesystem::directory_iterator("/proc/" + std::to_string(pid) + "/task", gone)) {
    std::ifstream list(thread.path() / "children");
    for (pid_t child = 0; list >> child;)
      children.push_back(child);
  }
  return children;
}

}  // namespace

Program::Program(const std::vector<std::string>& command, const Environment& environment)
    : output_(scratch_file()), errors_(scratch_file()), began_(std::chrono::steady_clock::now()) {
  pid_ = fork();
  if (pid_ == 0) become(command, environment, output_, errors_);
  EXPECT_GT(pid_, 0) << "fork";
}

Program::~Program() {
  if (running()) {
    ::kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  std::filesystem::remove(output_);
  std::filesystem::remove(errors_);
}

bool Program::try_collect() {
  int status = 0;
  if (!status_ && waitpid(pid_, &status, WNOHANG) == pid_) status_ = status;
  return status_.has_value();
}

bool Program::running() {
  return !try_collect();
}

void Program::signal(int number) const {
  EXPECT_FALSE(status_) << "it has ended already";
  EXPECT_EQ(::kill(pid_, number), 0);
}

std::optional<pid_t> Program::child(const std::string& name) {
  std::optional<pid_t> found;
  eventually([&] {
    for (const pid_t child : children_of(pid_)) {
      const std::vector<std::string> words = command_line(child);
      if (!words.empty() && std::filesystem::path(words.front()).filename() == name) found = child;
    }
    return found || !running();
  });
  return found;
}

Ended Program::wait(std::chrono::seconds limit) {
  const bool in_time = eventually([this] { return try_collect(); }, limit);
  Ended ended;
  ended.took = std::chrono::steady_clock::now() - began_;
  if (!in_time) {
    ADD_FAILURE() << "it did not end within " << limit.count() << " s";
    ::kill(pid_, SIGKILL);
    int status = 0;
    waitpid(pid_, &status, 0);
    status_ = status;
  } else {
    ended.code = WIFEXITED(*status_) ? WEXITSTATUS(*status_) : 128 + WTERMSIG(*status_);
  }
  ended.output = whole_file(output_);
  ended.errors = whole_file(errors_);
  return ended;
}

std::vector<std::string> command_line(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/cmdline");
  std::vector<std::string> words;
  for (std::string word; std::getline(file, word, '\0');)
    words.push_back(word);
  return words;
}

}  // namespace hil::scenario_test
