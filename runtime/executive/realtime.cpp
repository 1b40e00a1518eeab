#include "runtime/executive/realtime.hpp"

#include <fcntl.h>
#include <pthread.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

namespace hil::executive {
namespace {

constexpr std::size_t prefaulted_stack_bytes = 128 * 1024;

[[gnu::noinline]] void touch_stack() noexcept {
  volatile unsigned char stack[prefaulted_stack_bytes];
  for (std::size_t byte = 0; byte < prefaulted_stack_bytes; byte += 1024)
    stack[byte] = 0;
  (void)stack[0];
}

std::string error_name(int error) {
  const char* name = strerrorname_np(error);
  return name == nullptr ? std::to_string(error) : name;
}

bool has_capability(int capability) {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (!line.starts_with("CapEff:")) continue;
    return ((std::stoull(line.substr(7), nullptr, 16) >> capability) & 1) != 0;
  }
  return false;
}

}  // namespace

std::optional<std::string> why_refused(const RealtimeOptions& options) {
  if (options.scheduler == Scheduler::fifo && (options.priority < 2 || options.priority > 99)) {
    return "SCHED_FIFO priority " + std::to_string(options.priority) + "; from 2 to 99";
  }
  for (const int cpu : options.cpus) {
    if (cpu < 0 || cpu >= CPU_SETSIZE) {
      return "CPU " + std::to_string(cpu) + "; from 0 to " + std::to_string(CPU_SETSIZE - 1);
    }
  }
  return std::nullopt;
}

void add_once(std::vector<std::string>& sentences, std::string sentence) {
  if (std::find(sentences.begin(), sentences.end(), sentence) == sentences.end()) {
    sentences.push_back(std::move(sentence));
  }
}

ThreadRealtime::ThreadRealtime(const RealtimeOptions& options, int priority)
    : policy_before_(sched_getscheduler(0)) {
  sched_getparam(0, &parameters_before_);
  sched_getaffinity(0, sizeof cpus_before_, &cpus_before_);
  timer_slack_before_ns_ = prctl(PR_GET_TIMERSLACK);
  prctl(PR_SET_TIMERSLACK, 1UL);
  touch_stack();
  if (!options.cpus.empty()) bind_to(options.cpus);
  if (options.scheduler == Scheduler::fifo) become_fifo(priority);
}

ThreadRealtime::~ThreadRealtime() {
  if (fifo_ && sched_setscheduler(0, policy_before_, &parameters_before_) != 0) {
    // Without CAP_SYS_NICE the flag can not be cleared; it has no effect on an ordinary thread.
    sched_setscheduler(0, policy_before_ | SCHED_RESET_ON_FORK, &parameters_before_);
  }
  if (bound_) sched_setaffinity(0, sizeof cpus_before_, &cpus_before_);
  if (timer_slack_before_ns_ > 0)
    prctl(PR_SET_TIMERSLACK, static_cast<unsigned long>(timer_slack_before_ns_));
}

void ThreadRealtime::bind_to(const std::vector<int>& cpus) {
  cpu_set_t wanted;
  CPU_ZERO(&wanted);
  std::string names;
  for (const int cpu : cpus) {
    CPU_SET(static_cast<std::size_t>(cpu), &wanted);
    names += (names.empty() ? "" : ", ") + std::to_string(cpu);
  }
  bound_ = sched_setaffinity(0, sizeof wanted, &wanted) == 0;
  if (!bound_) {
    refused_.push_back("affinity to CPU " + names + " refused (" + error_name(errno) +
                       "): name CPUs that this machine has and this process may use");
    return;
  }
  cpu_set_t applied;
  sched_getaffinity(0, sizeof applied, &applied);
  if (!CPU_EQUAL(&applied, &wanted)) {
    refused_.push_back("affinity to CPU " + names + " applied in part: not all of them exist or are allowed");
  }
}

void ThreadRealtime::become_fifo(int priority) {
  sched_param parameters{};
  parameters.sched_priority = priority;
  fifo_ = sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &parameters) == 0;
  if (!fifo_) {
    refused_.push_back("SCHED_FIFO refused (" + error_name(errno) +
                       "): give CAP_SYS_NICE or an rtprio limit");
  }
}

ProcessRealtime::ProcessRealtime(const RealtimeOptions& options) {
  if (options.lock_memory) lock_memory();
  if (options.scheduler == Scheduler::fifo) keep_cpus_awake();
}

ProcessRealtime::~ProcessRealtime() {
  if (memory_locked_) munlockall();
  if (cpu_latency_file_ >= 0) close(cpu_latency_file_);
}

void ProcessRealtime::lock_memory() {
  // With a limit, MCL_FUTURE would make a later allocation fail elsewhere, so do not lock at all.
  constexpr int cap_ipc_lock = 14;
  rlimit limit{};
  getrlimit(RLIMIT_MEMLOCK, &limit);
  if (limit.rlim_cur != RLIM_INFINITY && !has_capability(cap_ipc_lock)) {
    refused_.push_back("memory is not locked (limit " + std::to_string(limit.rlim_cur / 1024) +
                       " KiB): give CAP_IPC_LOCK or an unlimited memlock limit");
    return;
  }
  memory_locked_ = mlockall(MCL_CURRENT | MCL_FUTURE) == 0;
  if (!memory_locked_) {
    refused_.push_back("mlockall refused (" + error_name(errno) + "): give CAP_IPC_LOCK and enough memory");
  }
}

void ProcessRealtime::keep_cpus_awake() {
  cpu_latency_file_ = open("/dev/cpu_dma_latency", O_WRONLY | O_CLOEXEC);
  const std::int32_t latency_us = 0;
  if (cpu_latency_file_ >= 0 && write(cpu_latency_file_, &latency_us, sizeof latency_us) == sizeof latency_us)
    return;
  refused_.push_back("/dev/cpu_dma_latency refused (" + error_name(errno) +
                     "): idle CPUs may sleep deeply and wake late");
}

}  // namespace hil::executive
