#include "bench/transactions/plain_file.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <system_error>

namespace hil::bench {
namespace {

[[noreturn]] void refuse(const char* call) {
  throw std::system_error(errno, std::generic_category(), call);
}

}  // namespace

PlainFile::PlainFile(const std::filesystem::path& path, std::uint64_t bytes)
    : descriptor_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644)) {
  if (descriptor_ < 0) refuse("open");
  if (::fallocate(descriptor_, 0, 0, static_cast<off_t>(bytes)) == 0 && ::fsync(descriptor_) == 0) return;
  const int number = errno;
  ::close(descriptor_);
  throw std::system_error(number, std::generic_category(), "fallocate");
}

PlainFile::~PlainFile() {
  ::close(descriptor_);
}

void PlainFile::append(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset_));
    if (written < 0) refuse("pwrite");
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset_ += static_cast<std::uint64_t>(written);
  }
  if (::fdatasync(descriptor_) != 0) refuse("fdatasync");
}

}  // namespace hil::bench
