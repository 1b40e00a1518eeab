#include "runtime/run/descriptors.hpp"

#include <fcntl.h>
#include <sys/eventfd.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <string>
#include <vector>

#include "io/device.hpp"
#include "runtime/buses/bus.hpp"

namespace hil::run {
namespace {

/// Upper bounds: for the GPU driver, the database's log and the files of the run together; for each process.
constexpr std::size_t needed_by_run = 64;
constexpr std::size_t needed_by_each_process = 8;

std::size_t needed_by(const config::Scenario& scenario) {
  std::size_t needed = needed_by_run + needed_by_each_process * scenario.processes.size();
  for (const auto& section : scenario.buses)
    needed += buses::type_of(*section).max_descriptors;
  return needed;
}

/// The number of descriptors that this process can open now, at most `wanted`.
std::size_t descriptors_left(std::size_t wanted) {
  std::vector<int> opened;
  opened.reserve(wanted);
  for (int fd = eventfd(0, EFD_CLOEXEC); fd >= 0; fd = fcntl(opened.front(), F_DUPFD_CLOEXEC, 0)) {
    opened.push_back(fd);
    if (opened.size() == wanted) break;
  }
  for (const int fd : opened)
    close(fd);
  return opened.size();
}

}  // namespace

void require_descriptors(const config::Scenario& scenario) {
  const std::size_t needed = needed_by(scenario);
  std::size_t left = descriptors_left(needed);
  if (left == needed) return;
  rlimit limit{};
  getrlimit(RLIMIT_NOFILE, &limit);
  const rlim_t wanted = limit.rlim_cur + (needed - left);
  limit.rlim_cur = std::min(wanted, limit.rlim_max);
  setrlimit(RLIMIT_NOFILE, &limit);
  left = descriptors_left(needed);
  if (left == needed) return;
  throw io::DeviceError("the run needs " + std::to_string(needed) + " more open files, but only " +
                        std::to_string(left) + " are possible: the limit of open files is " +
                        std::to_string(limit.rlim_cur) + "; raise it to at least " + std::to_string(wanted) +
                        " (ulimit -n " + std::to_string(wanted) + ")");
}

}  // namespace hil::run
