#include "io/virtual/socket_folder.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "io/device.hpp"

namespace hil::io::virtual_bus {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view name_begin = "hil-bus-";

fs::path base() {
  const char* const chosen = std::getenv("TMPDIR");
  return chosen != nullptr && *chosen != '\0' ? chosen : "/tmp";
}

/// The lock of a folder; none when another process holds it or the folder does not exist.
process::Descriptor lock_of(const fs::path& folder) {
  process::Descriptor fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC));
  struct stat locked {};
  struct stat named {};
  if (fd.get() < 0 || ::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) return {};
  // Between opening and locking, the folder may have been removed and created again.
  if (::fstat(fd.get(), &locked) != 0 || ::lstat(folder.c_str(), &named) != 0) return {};
  if (locked.st_ino != named.st_ino || locked.st_uid != ::geteuid()) return {};
  return fd;
}

/// Removes sockets only; a folder with anything else in it is kept.
void remove_folder(const fs::path& folder) {
  std::error_code ignored;
  for (fs::directory_iterator entry(folder, ignored), end; entry != end; entry.increment(ignored)) {
    if (fs::is_socket(entry->symlink_status(ignored))) ::unlink(entry->path().c_str());
  }
  ::rmdir(folder.c_str());
}

void remove_abandoned() {
  std::error_code ignored;
  for (fs::directory_iterator entry(base(), ignored), end; entry != end; entry.increment(ignored)) {
    if (!entry->path().filename().string().starts_with(name_begin)) continue;
    if (const process::Descriptor lock = lock_of(entry->path()); lock.get() >= 0)
      remove_folder(entry->path());
  }
}

}  // namespace

SocketFolder SocketFolder::make() {
  remove_abandoned();
  constexpr int max_attempts = 10;  // another run may consider the folder abandoned before it is locked
  SocketFolder folder;
  for (int attempt = 0; attempt < max_attempts; ++attempt) {
    folder.path_ = (base() / (std::string(name_begin) + "XXXXXX")).string();
    if (::mkdtemp(folder.path_.data()) == nullptr) break;
    folder.lock_ = lock_of(folder.path_);
    if (folder.lock_.get() >= 0) return folder;
  }
  throw DeviceError("a virtual CAN bus needs a folder for its socket, and '" + folder.path_ +
                    "' can not be made: " + std::strerror(errno));
}

SocketFolder::~SocketFolder() {
  if (lock_.get() >= 0) remove_folder(path_);
}

}  // namespace hil::io::virtual_bus
