#pragma once
// The port to the disk: one directory, and the few calls that a log makes in it. Nothing throws but std::bad_alloc; a
// call that failed says with which error number, which call it was and on which file.
//
// Threads: calls on different files may be made at once; one file is one thread's at a time.

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
  allocate,  ///< not the disk's: memory on the way to it
};

struct DiskError {
  DiskCall call = DiskCall::open;
  int number = 0;    ///< errno
  std::string file;  ///< empty: of allocate

  /// "write of segment.0000000003: No space left on device"
  std::string in_words() const;
};

/// What is told of std::bad_alloc on the way to the disk.
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

/// Nothing, or what went wrong.
using DiskFault = std::optional<DiskError>;

/// Memory that begins at a multiple of this is fit for every disk.
inline constexpr std::size_t disk_page_bytes = 4096;

/// Closed when it is destroyed.
class DiskFile {
 public:
  virtual ~DiskFile() = default;

  /// All of the bytes, or a fault; after a fault any of them may be there. Beyond the end the file grows. Whole sectors at a
  /// multiple of a sector may be taken from where they lie, where that is fit for it, without a copy in the machine's cache.
  virtual DiskFault write(std::uint64_t offset, std::span<const std::byte> bytes) = 0;
  /// The file is at least that long afterwards, zeros where nothing was, and has its blocks where the file system gives
  /// them beforehand.
  virtual DiskFault preallocate(std::uint64_t bytes) = 0;
  /// What was written is on the disk. After a fault what was written since the last call that had none may be lost, even
  /// where a later call has none. A file that was deleted meanwhile is a fault.
  virtual DiskFault sync() = 0;

  /// As many bytes as there are: fewer than asked for at the end of the file.
  virtual DiskResult<std::size_t> read(std::uint64_t offset, std::span<std::byte> bytes) = 0;
  virtual DiskResult<std::uint64_t> size() = 0;
};

/// The exclusive right to write in the directory; given back when it is destroyed.
class DiskLock {
 public:
  virtual ~DiskLock() = default;
};

class Disk {
 public:
  virtual ~Disk() = default;

  /// A new file to write and read; one of that name is a fault (EEXIST).
  virtual DiskResult<std::unique_ptr<DiskFile>> create(std::string_view name) = 0;
  /// A file to read alone.
  virtual DiskResult<std::unique_ptr<DiskFile>> open(std::string_view name) = 0;
  /// Names of all files, in no order.
  virtual DiskResult<std::vector<std::string>> list() = 0;
  virtual DiskFault rename(std::string_view from, std::string_view to) = 0;
  virtual DiskFault remove(std::string_view name) = 0;
  /// Names that came, went or changed are on the disk.
  virtual DiskFault sync_directory() = 0;
  /// A fault (EWOULDBLOCK) where another has the directory.
  virtual DiskResult<std::unique_ptr<DiskLock>> lock(std::string_view name) = 0;
};

}  // namespace rtstdb::log
