#include "runtime/run/process_watch.hpp"

#include <poll.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>

#include "runtime/report/text_safety.hpp"

namespace hil::run {
namespace {

constexpr std::int64_t stop_timeout_ns = 1'000'000'000;

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : " ") + word;
  return text;
}

/// Up to 5 lines, and of each up to 200 bytes; fewer when they are in more than the last 4 KiB of the file.
std::vector<std::string> last_lines(const std::filesystem::path& file) {
  constexpr std::size_t max_lines = 5, max_line_bytes = 200;
  constexpr std::streamoff max_bytes = 4096;
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in) return {};
  const std::streamoff size = in.tellg(), begin = std::max<std::streamoff>(0, size - max_bytes);
  in.seekg(begin);
  std::vector<std::string> lines;
  std::string line;
  if (begin > 0) std::getline(in, line);  // the rest of a line
  while (std::getline(in, line)) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    lines.push_back(report::one_line(line.substr(0, max_line_bytes)));
  }
  if (lines.size() > max_lines) lines.erase(lines.begin(), lines.end() - max_lines);
  return lines;
}

}  // namespace

ProcessWatch::ProcessWatch(const std::vector<Program>& programs, RunTimeNow now_ns)
    : now_ns_(std::move(now_ns)) {
  for (const Program& program : programs) {
    auto child = std::make_unique<io::process::Child>(program.child);
    watched_.push_back({.child = std::move(child),
                        .exit = {.name = program.child.name,
                                 .command = joined(program.child.command),
                                 .exit = "running",
                                 .safe_on_exit = program.safe_on_exit,
                                 .may_be_lost = program.may_be_lost,
                                 .output_fault = {}},
                        .output_file = program.child.output_file,
                        .fault = std::make_unique<std::atomic<const std::string*>>(nullptr)});
  }
  wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
}

ProcessWatch::~ProcessWatch() {
  stop();
  close(wake_);
}

void ProcessWatch::set_paused(std::size_t program, bool paused) noexcept {
  const pid_t group = watched_[program].child->pid();
  if (group > 0) ::kill(-group, paused ? SIGSTOP : SIGCONT);
}

void ProcessWatch::kill_for_fault(std::size_t program, const std::string& fault) noexcept {
  Watched& watched = watched_[program];
  if (is_killed(program)) return;
  watched.killed_at_ns = now_ns_();
  watched.fault->store(&fault, std::memory_order_release);
  if (watched.child->pid() > 0) ::kill(-watched.child->pid(), SIGKILL);
}

std::vector<std::string> ProcessWatch::started() const {
  std::vector<std::string> all;
  for (const Watched& watched : watched_) {
    all.push_back(watched.exit.name + " (process " + std::to_string(watched.child->pid()) +
                  "): " + watched.exit.command);
  }
  return all;
}

pid_t ProcessWatch::process_of(const std::string& name) const {
  for (const Watched& watched : watched_) {
    if (watched.exit.name == name) return watched.child->pid();
  }
  return -1;
}

ProcessWatch::Watching ProcessWatch::watch(std::function<void(const ProcessExit&)> on_exit,
                                           std::function<void()> every_second) {
  on_exit_ = std::move(on_exit);
  every_second_ = std::move(every_second);
  thread_ = std::thread([this] { serve(); });
  return Watching(*this);
}

/// A process that a fault killed ended at that instant, however late its end is found.
void ProcessWatch::take_fault(Watched& watched) {
  const std::string* const fault = watched.fault->load(std::memory_order_acquire);
  if (fault == nullptr) return;
  watched.exit.ended_early = true;
  watched.exit.ended_at_ns = watched.killed_at_ns;
  watched.exit.fault = *fault;
  watched.exit.safe_on_exit = false;
}

void ProcessWatch::check_children() {
  for (Watched& watched : watched_) {
    if (watched.exit.ended_early || watched.child->running()) continue;
    watched.exit.ended_early = true;
    watched.exit.ended_at_ns = now_ns_();
    watched.exit.exit = io::process::describe(watched.child->exit());
    take_fault(watched);
    if (on_exit_) on_exit_(watched.exit);
  }
}

void ProcessWatch::serve() {
  using SteadyClock = std::chrono::steady_clock;
  auto next_second = SteadyClock::now() + std::chrono::seconds(1);
  std::vector<pollfd> waiting;
  while (!stopping_.load()) {
    waiting.assign(1, {.fd = wake_, .events = POLLIN, .revents = 0});
    for (const Watched& watched : watched_) {
      if (!watched.exit.ended_early)
        waiting.push_back({.fd = watched.child->exit_fd(), .events = POLLIN, .revents = 0});
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next_second - SteadyClock::now());
    poll(waiting.data(), waiting.size(), static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (stopping_.load()) return;
    check_children();
    if (SteadyClock::now() < next_second) continue;
    next_second += std::chrono::seconds(1);
    if (every_second_) every_second_();
  }
}

void ProcessWatch::end_watch() {
  stopping_.store(true);
  if (!thread_.joinable()) return;
  eventfd_write(wake_, 1);
  thread_.join();
}

void ProcessWatch::end_watch_after_exit(std::chrono::milliseconds timeout) {
  end_watch();
  std::vector<pollfd> waiting;
  for (const Watched& watched : watched_) {
    if (watched.exit.ended_early && watched.exit.safe_on_exit) return;
    if (watched.exit.ended_early) continue;
    waiting.push_back({.fd = watched.child->exit_fd(), .events = POLLIN, .revents = 0});
  }
  poll(waiting.data(), waiting.size(), static_cast<int>(timeout.count()));
  check_children();
}

std::vector<ProcessExit> ProcessWatch::stop() {
  end_watch();
  std::vector<ProcessExit> exits;
  for (Watched& watched : watched_) {
    if (watched.child != nullptr && !watched.exit.ended_early) {
      if (watched.child->pid() > 0) ::kill(-watched.child->pid(), SIGCONT);  // a fault may have paused it
      watched.exit.exit = io::process::describe(watched.child->stop(stop_timeout_ns));
      take_fault(watched);
    }
    if (watched.child != nullptr) watched.exit.output_fault = watched.child->output_fault();
    watched.child.reset();  // its output is complete now
    if (watched.exit.ended_early && watched.exit.fault.empty() && watched.exit.last_lines.empty())
      watched.exit.last_lines = last_lines(watched.output_file);
    exits.push_back(watched.exit);
  }
  return exits;
}

std::string ProcessWatch::first_ended() {
  check_children();
  for (const Watched& watched : watched_) {
    if (watched.exit.ended_early) return watched.exit.name;
  }
  return {};
}

}  // namespace hil::run
