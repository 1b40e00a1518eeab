#include "runtime/run/process_watch.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <chrono>

namespace hil::run {
namespace {

constexpr std::int64_t stop_limit_ns = 1'000'000'000;

std::string joined(const std::vector<std::string>& words) {
  std::string text;
  for (const std::string& word : words)
    text += (text.empty() ? "" : " ") + word;
  return text;
}

}  // namespace

ProcessWatch::ProcessWatch(const std::vector<Program>& programs, RunTimeNow now_ns)
    : now_ns_(std::move(now_ns)) {
  for (const Program& program : programs) {
    auto child = std::make_unique<io::process::Child>(program.child);
    watched_.push_back({.child = std::move(child),
                        .exit_state = {.name = program.child.name,
                                       .command = joined(program.child.command),
                                       .exit = "running",
                                       .safe_on_exit = program.safe_on_exit,
                                       .may_be_lost = program.may_be_lost,
                                       .output_fault = {}}});
  }
  wake_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
}

ProcessWatch::~ProcessWatch() {
  stop();
  close(wake_);
}

std::vector<std::string> ProcessWatch::started() const {
  std::vector<std::string> all;
  for (const Watched& watched : watched_) {
    all.push_back(watched.exit_state.name + " (process " + std::to_string(watched.child->pid()) +
                  "): " + watched.exit_state.command);
  }
  return all;
}

pid_t ProcessWatch::process_of(const std::string& name) const {
  for (const Watched& watched : watched_) {
    if (watched.exit_state.name == name) return watched.child->pid();
  }
  return -1;
}

ProcessWatch::Watching ProcessWatch::watch(std::function<void(const ProcessExit&)> on_death,
                                           std::function<void()> every_second) {
  on_death_ = std::move(on_death);
  every_second_ = std::move(every_second);
  thread_ = std::thread([this] { serve(); });
  return Watching(*this);
}

void ProcessWatch::look_at_children() {
  for (Watched& watched : watched_) {
    if (watched.exit_state.ended_early || watched.child->running()) continue;
    watched.exit_state.ended_early = true;
    watched.exit_state.ended_at_ns = now_ns_();
    watched.exit_state.exit = io::process::describe(watched.child->exit());
    if (on_death_) on_death_(watched.exit_state);
  }
}

void ProcessWatch::serve() {
  using SteadyClock = std::chrono::steady_clock;
  auto next_second = SteadyClock::now() + std::chrono::seconds(1);
  std::vector<pollfd> waiting;
  while (!stopping_.load()) {
    waiting.assign(1, {.fd = wake_, .events = POLLIN, .revents = 0});
    for (const Watched& watched : watched_) {
      if (!watched.exit_state.ended_early)
        waiting.push_back({.fd = watched.child->exit_fd(), .events = POLLIN, .revents = 0});
    }
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(next_second - SteadyClock::now());
    poll(waiting.data(), waiting.size(), static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (stopping_.load()) return;
    look_at_children();
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

void ProcessWatch::end_watch_after_an_end(std::chrono::milliseconds at_most) {
  end_watch();
  std::vector<pollfd> waiting;
  for (const Watched& watched : watched_) {
    if (watched.exit_state.ended_early && watched.exit_state.safe_on_exit) return;
    if (watched.exit_state.ended_early) continue;  // nobody waits for it
    waiting.push_back({.fd = watched.child->exit_fd(), .events = POLLIN, .revents = 0});
  }
  poll(waiting.data(), waiting.size(), static_cast<int>(at_most.count()));
  look_at_children();
}

std::vector<ProcessExit> ProcessWatch::stop() {
  end_watch();
  std::vector<ProcessExit> exits;
  for (Watched& watched : watched_) {
    if (watched.child != nullptr && !watched.exit_state.ended_early) {
      watched.exit_state.exit = io::process::describe(watched.child->stop(stop_limit_ns));
    }
    if (watched.child != nullptr) watched.exit_state.output_fault = watched.child->output_fault();
    watched.child.reset();
    exits.push_back(watched.exit_state);
  }
  return exits;
}

std::string ProcessWatch::first_ended() {
  look_at_children();
  for (const Watched& watched : watched_) {
    if (watched.exit_state.ended_early) return watched.exit_state.name + " " + watched.exit_state.exit;
  }
  return {};
}

}  // namespace hil::run
