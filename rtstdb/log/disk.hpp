#pragma once
// The interface to the disk: one directory and the operations that a log needs. Only std::bad_alloc is
// thrown. A failed operation returns its error number, its kind and its file.
//
// Threads: operations on different files may run at the same time; a file is used by one thread at a time.

#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace rtstdb::log {

enum class DiskCall : std::uint8_t {
  create,
  open,
  read,
  write,
  preallocate,
  sync,
  size,
  list,
  rename,
  remove,
  sync_directory,
  lock,
  allocate,  ///< not a disk operation: memory for one ran out
};

// The analyzer does not follow which value a Result has.
struct DiskError {  // NOLINT(clang-analyzer-core.uninitialized.Assign)
  DiskCall call = DiskCall::open;
  int number = 0;    ///< errno
  std::string file;  ///< empty for allocate

  /// "write of segment.0000000003: No space left on device"
  std::string describe() const;
};

/// The fault that a std::bad_alloc during a disk operation becomes.
inline DiskError no_memory() noexcept {
  return {DiskCall::allocate, ENOMEM, {}};
}

/// A value or a DiskError.
template <class T>
class [[nodiscard]] DiskResult {
 public:
  DiskResult(T value)
      : state_(std::in_place_index<0>, std::move(value)) {}  // NOLINT(google-explicit-constructor)
  DiskResult(DiskError error)
      : state_(std::in_place_index<1>, std::move(error)) {}  // NOLINT(google-explicit-constructor)

  explicit operator bool() const noexcept { return state_.index() == 0; }
  T& value() { return std::get<0>(state_); }
  const DiskError& error() const { return std::get<1>(state_); }

 private:
  std::variant<T, DiskError> state_;
};

/// Success (empty), or an error.
using DiskFault = std::optional<DiskError>;

/// Memory with this alignment is suitable for direct I/O on every disk.
inline constexpr std::size_t disk_page_bytes = 4096;

/// An open file. The destructor closes it.
class DiskFile {
 public:
  virtual ~DiskFile() = default;

  /// Writes all bytes; after a fault, any of them may be written. The file grows if necessary. Whole sectors
  /// at a multiple of the sector size, in suitably aligned memory, may be written directly, without a copy in
  /// the page cache.
  virtual DiskFault write(std::uint64_t offset, std::span<const std::byte> bytes) = 0;
  /// Extends the file to at least that length, with zeros, and allocates its blocks if the file system
  /// supports that.
  virtual DiskFault preallocate(std::uint64_t bytes) = 0;
  /// Brings everything written to disk. After a fault, everything written since the last successful call may
  /// be lost, even if a later call succeeds. A file that was deleted during the call is a fault.
  virtual DiskFault sync() = 0;

  /// Returns the number of bytes read: fewer than requested at the end of the file.
  virtual DiskResult<std::size_t> read(std::uint64_t offset, std::span<std::byte> bytes) = 0;
  virtual DiskResult<std::uint64_t> size() = 0;
};

/// The exclusive right to write to the directory. The destructor releases it.
class DiskLock {
 public:
  virtual ~DiskLock() = default;
};

/// A directory.
class Disk {
 public:
  virtual ~Disk() = default;

  /// Creates a file for writing and reading. Fault EEXIST: the name exists.
  virtual DiskResult<std::unique_ptr<DiskFile>> create(std::string_view name) = 0;
  /// Opens a file for reading.
  virtual DiskResult<std::unique_ptr<DiskFile>> open(std::string_view name) = 0;
  /// The names of all files, unordered.
  virtual DiskResult<std::vector<std::string>> list() = 0;
  virtual DiskFault rename(std::string_view from, std::string_view to) = 0;
  virtual DiskFault remove(std::string_view name) = 0;
  /// Brings created, removed and renamed names to disk.
  virtual DiskFault sync_directory() = 0;
  /// Fault EWOULDBLOCK: another process or database holds the lock.
  virtual DiskResult<std::unique_ptr<DiskLock>> lock(std::string_view name) = 0;
};

}  // namespace rtstdb::log
