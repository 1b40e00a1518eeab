#include "runtime/run/run_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>
#include <system_error>

#include "io/device.hpp"

namespace hil::run {
namespace {

namespace fs = std::filesystem;

void remove_results(const fs::path& directory) {
  const auto remove = [](const fs::path& file) {
    std::error_code error;
    fs::remove(file, error);
    if (error)
      throw io::DeviceError(file.string() + " of an earlier run can not be removed: " + error.message());
  };
  for (const char* file : {"report.json", "report.html", "junit.xml", "trace.json", "pictures/top-view.svg"})
    remove(directory / file);
  for (int i = 1; fs::exists(directory / "pictures" / ("scan-" + std::to_string(i) + ".svg")); ++i)
    remove(directory / "pictures" / ("scan-" + std::to_string(i) + ".svg"));
}

}  // namespace

RunFolder::RunFolder(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw io::DeviceError("folder " + directory.string() + " can not be made: " + error.message());
  lock_ = ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock_ < 0) {
    throw io::DeviceError("folder " + directory.string() + " can not be opened: " + std::strerror(errno));
  }
  if (::flock(lock_, LOCK_EX | LOCK_NB) != 0) {
    const int answer = errno;
    ::close(lock_);
    throw io::DeviceError("folder " + directory.string() +
                          (answer == EWOULDBLOCK
                               ? std::string(" is in use by another run")
                               : " can not be locked: " + std::string(std::strerror(answer))));
  }
  try {
    remove_results(directory);
  } catch (...) {
    ::close(lock_);
    throw;
  }
}

RunFolder::~RunFolder() {
  ::close(lock_);
}

}  // namespace hil::run
