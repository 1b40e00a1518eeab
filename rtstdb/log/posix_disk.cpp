#include "rtstdb/log/posix_disk.hpp"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <random>

#include "rtstdb/log/file_size_signal.hpp"

namespace rtstdb::log {
namespace {

/// Largest size of one system call, below the kernel's limit (2 GiB), at which it would be cut short.
constexpr std::size_t max_bytes_per_call = std::size_t{1} << 30;

template <class Call>
auto retry_interrupted(const Call& call) {
  auto result = call();
  while (result == -1 && errno == EINTR)
    result = call();
  return result;
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(Descriptor&& other) noexcept : number_(std::exchange(other.number_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(number_, other.number_);
    return *this;
  }
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int get() const { return number_; }
  int release() { return std::exchange(number_, -1); }
  bool valid() const { return number_ >= 0; }

 private:
  int number_;
};

/// A second descriptor of a file for direct I/O, which bypasses the page cache: the log is not read soon, and
/// the copy in the cache costs as much time as the disk. Not open if the file system does not support direct
/// I/O.
class DirectIo {
 public:
  DirectIo() = default;
  explicit DirectIo(Descriptor descriptor) : descriptor_(std::move(descriptor)) {
    struct statx status {};
    if (!is_open() || ::statx(descriptor_.get(), "", AT_EMPTY_PATH, STATX_DIOALIGN, &status) != 0) return;
    if ((status.stx_mask & STATX_DIOALIGN) == 0) return;  // older kernel: it fails with EINVAL instead
    sector_bytes_ = status.stx_dio_offset_align;
    memory_alignment_ = status.stx_dio_mem_align;
    if (sector_bytes_ == 0) close();
  }

  bool takes(std::uint64_t offset, std::span<const std::byte> bytes) const {
    return is_open() && offset % sector_bytes_ == 0 && bytes.size() % sector_bytes_ == 0 &&
           reinterpret_cast<std::uintptr_t>(bytes.data()) % memory_alignment_ == 0;
  }
  int get() const { return descriptor_.get(); }
  void close() { descriptor_ = Descriptor(-1); }

 private:
  bool is_open() const { return descriptor_.valid(); }

  Descriptor descriptor_{-1};
  std::uint64_t sector_bytes_ = 512;
  std::uint64_t memory_alignment_ = disk_page_bytes;
};

class PosixFile final : public DiskFile {
 public:
  PosixFile(Descriptor descriptor, DirectIo direct, std::string name)
      : descriptor_(std::move(descriptor)),
        direct_(std::move(direct)),
        name_(std::move(name)),
        has_link_count_(names() > 0) {}

  DiskFault write(std::uint64_t offset, std::span<const std::byte> bytes) override {
    const FileSizeSignalBlocked signal_blocked;
    while (!bytes.empty()) {
      const auto piece = bytes.first(std::min(bytes.size(), max_bytes_per_call));
      const bool directly = direct_.takes(offset, piece);
      const auto written = retry_interrupted([&] {
        return ::pwrite(directly ? direct_.get() : descriptor_.get(), piece.data(), piece.size(),
                        static_cast<off_t>(offset));
      });
      if (written < 0 && errno == EINVAL && directly) {
        direct_.close();
        continue;
      }
      if (written < 0) return fault(DiskCall::write, errno);
      if (written == 0) return fault(DiskCall::write, EIO);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
      offset += static_cast<std::uint64_t>(written);
    }
    return std::nullopt;
  }

  DiskFault preallocate(std::uint64_t bytes) override {
    const FileSizeSignalBlocked signal_blocked;
    const int refused =
        retry_interrupted([&] { return ::fallocate(descriptor_.get(), 0, 0, static_cast<off_t>(bytes)); });
    if (refused == 0) return std::nullopt;
    if (errno != EOPNOTSUPP && errno != ENOSYS) return fault(DiskCall::preallocate, errno);
    // The file system cannot allocate ahead: only the length is set.
    if (retry_interrupted([&] { return ::ftruncate(descriptor_.get(), static_cast<off_t>(bytes)); }) != 0)
      return fault(DiskCall::preallocate, errno);
    return std::nullopt;
  }

  // A failed fdatasync may have dropped the dirty pages, so it is not retried. An interrupted one has done
  // nothing.
  DiskFault sync() override {
    if (retry_interrupted([&] { return ::fdatasync(descriptor_.get()); }) != 0)
      return fault(DiskCall::sync, errno);
    // A deleted file accepts all writes and is lost at the end of the process.
    if (has_link_count_ && names() == 0) return fault(DiskCall::sync, ENOENT);
    return std::nullopt;
  }

  DiskResult<std::size_t> read(std::uint64_t offset, std::span<std::byte> bytes) override {
    std::size_t count = 0;
    while (count < bytes.size()) {
      const std::size_t wanted = std::min(bytes.size() - count, max_bytes_per_call);
      const auto got = retry_interrupted([&] {
        return ::pread(descriptor_.get(), bytes.data() + count, wanted, static_cast<off_t>(offset + count));
      });
      if (got < 0) return fault(DiskCall::read, errno);
      if (got == 0) break;
      count += static_cast<std::size_t>(got);
    }
    return count;
  }

  DiskResult<std::uint64_t> size() override {
    struct stat state {};
    if (::fstat(descriptor_.get(), &state) != 0) return fault(DiskCall::size, errno);
    return static_cast<std::uint64_t>(state.st_size);
  }

 private:
  DiskError fault(DiskCall call, int number) const { return {call, number, name_}; }
  std::uint64_t names() const {
    struct stat status {};
    return ::fstat(descriptor_.get(), &status) == 0 ? status.st_nlink : 1;
  }

  Descriptor descriptor_;
  DirectIo direct_;
  std::string name_;
  bool has_link_count_;  // false: the file system reports no link count
};

class PosixLock final : public DiskLock {
 public:
  explicit PosixLock(Descriptor descriptor) : descriptor_(std::move(descriptor)) {}

 private:
  Descriptor descriptor_;  // closing it releases the flock
};

class PosixDisk final : public Disk {
 public:
  explicit PosixDisk(Descriptor directory) : directory_(std::move(directory)) {}

  DiskResult<std::unique_ptr<DiskFile>> create(std::string_view name) override {
    auto created = descriptor(DiskCall::create, name, O_RDWR | O_CREAT | O_EXCL);
    if (!created) return created.error();
    auto direct = descriptor(DiskCall::open, name, O_WRONLY | O_DIRECT);
    return std::unique_ptr<DiskFile>(std::make_unique<PosixFile>(
        std::move(created.value()), direct ? DirectIo(std::move(direct.value())) : DirectIo(),
        std::string(name)));
  }
  DiskResult<std::unique_ptr<DiskFile>> open(std::string_view name) override {
    auto opened =
        descriptor(DiskCall::open, name, O_RDONLY | O_NONBLOCK);  // O_NONBLOCK: opening a pipe must not block
    if (!opened) return opened.error();
    return std::unique_ptr<DiskFile>(
        std::make_unique<PosixFile>(std::move(opened.value()), DirectIo(), std::string(name)));
  }

  DiskResult<std::vector<std::string>> list() override {
    // A separate descriptor, since closedir closes it.
    Descriptor own(retry_interrupted(
        [&] { return ::openat(directory_.get(), ".", O_RDONLY | O_DIRECTORY | O_CLOEXEC); }));
    if (!own.valid()) return fault(DiskCall::list, ".");
    DIR* stream = ::fdopendir(own.get());
    if (stream == nullptr) return fault(DiskCall::list, ".");
    own.release();
    std::vector<std::string> names;
    errno = 0;
    while (const dirent* entry = ::readdir(stream)) {
      const std::string_view name = entry->d_name;
      if (name != "." && name != "..") names.emplace_back(name);
    }
    const int number = errno;
    ::closedir(stream);
    if (number != 0) return DiskError{DiskCall::list, number, "."};
    return names;
  }

  DiskFault rename(std::string_view from, std::string_view to) override {
    const std::string old_name(from);
    const std::string new_name(to);
    if (::renameat(directory_.get(), old_name.c_str(), directory_.get(), new_name.c_str()) != 0)
      return fault(DiskCall::rename, from);
    return std::nullopt;
  }
  DiskFault remove(std::string_view name) override {
    if (::unlinkat(directory_.get(), std::string(name).c_str(), 0) != 0) return fault(DiskCall::remove, name);
    return std::nullopt;
  }
  DiskFault sync_directory() override {
    if (retry_interrupted([&] { return ::fsync(directory_.get()); }) != 0)
      return fault(DiskCall::sync_directory, ".");
    return std::nullopt;
  }

  DiskResult<std::unique_ptr<DiskLock>> lock(std::string_view name) override {
    const std::string path(name);
    Descriptor descriptor(retry_interrupted(
        [&] { return ::openat(directory_.get(), path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644); }));
    if (!descriptor.valid()) return fault(DiskCall::lock, name);
    if (retry_interrupted([&] { return ::flock(descriptor.get(), LOCK_EX | LOCK_NB); }) != 0)
      return fault(DiskCall::lock, name);
    return std::unique_ptr<DiskLock>(std::make_unique<PosixLock>(std::move(descriptor)));
  }

 private:
  static DiskError fault(DiskCall call, std::string_view name) { return {call, errno, std::string(name)}; }

  DiskResult<Descriptor> descriptor(DiskCall call, std::string_view name, int flags) {
    const std::string path(name);
    Descriptor opened(
        retry_interrupted([&] { return ::openat(directory_.get(), path.c_str(), flags | O_CLOEXEC, 0644); }));
    if (!opened.valid()) return fault(call, name);
    return opened;
  }

  Descriptor directory_;
};

}  // namespace

DiskResult<std::unique_ptr<Disk>> open_directory(const std::filesystem::path& directory) {
  if (::mkdir(directory.c_str(), 0755) != 0 && errno != EEXIST)
    return DiskError{DiskCall::create, errno, directory.string()};
  return open_existing_directory(directory);
}

DiskResult<std::unique_ptr<Disk>> open_existing_directory(const std::filesystem::path& directory) {
  Descriptor descriptor(
      retry_interrupted([&] { return ::open(directory.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC); }));
  if (!descriptor.valid()) return DiskError{DiskCall::open, errno, directory.string()};
  return std::unique_ptr<Disk>(std::make_unique<PosixDisk>(std::move(descriptor)));
}

std::uint64_t new_database_id() {
  std::random_device device;
  std::uint64_t id = 0;
  while (id == 0)
    id = std::uint64_t{device()} << 32 | device();
  return id;
}

}  // namespace rtstdb::log
