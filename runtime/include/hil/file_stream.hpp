#pragma once
// The port through which a module hands data to the run while it goes on, for files in the folder of the run.
// The tick fills buffers in turn; on an ordinary thread the module's encoder makes files of them.
//
// If all buffers of a stream wait for the disk, the next one is dropped and counted. Under the virtual clock
// the tick waits for the disk instead, and none is dropped. The report says what is not in files.
//
// Threads: open at setup; begin and finish in the tick, where they do not allocate, and block only under the
// virtual clock; encode on an ordinary thread, for one buffer at a time; record after the last tick.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include <hil/png_image.hpp>

namespace hil::modules {

/// Writes files into the folder of a stream.
class FileOutput {
 public:
  virtual ~FileOutput() = default;
  /// Both return false if the file could not be written, which the run counts and reports.
  virtual bool write(const std::string& name, std::span<const std::byte> content) = 0;
  virtual bool write(const std::string& name, const PngImage& image) = 0;
};

class FileEncoder {
 public:
  virtual ~FileEncoder() = default;
  /// Makes files of a buffer. `buffer`: what the tick has filled of it. It may be changed.
  virtual void encode(std::span<std::byte> buffer, std::int64_t time_ns, FileOutput& files) = 0;
};

struct FileStreamOptions {
  std::string folder{};  ///< in the folder of the run: "images" (.png), "pointclouds" (.pcd), "files"
  std::string owner{};   ///< for sentences: "camera front"
  std::string singular{}, plural{};  ///< what a buffer holds: "image", "images"
  std::size_t buffer_bytes = 0;      ///< above 0
  /// No file is begun once the files of the stream have this size.
  std::uint64_t max_bytes = std::numeric_limits<std::uint64_t>::max();
  std::shared_ptr<FileEncoder> encoder{};
};

/// What became of the buffers of a stream.
struct FileStreamRecord {
  std::uint64_t dropped = 0;                   ///< the disk was too slow
  std::uint64_t beyond_limit = 0;              ///< not written, since the files had max_bytes
  std::string last_file{};                     ///< in the folder of the run; empty: none was written
  std::optional<std::int64_t> last_time_ns{};  ///< of its buffer
};

class FileStream {
 public:
  virtual ~FileStream() = default;
  /// The next buffer, aligned as for std::max_align_t. Empty: it is dropped.
  virtual std::span<std::byte> begin() noexcept = 0;
  /// Hands over the first `bytes` of the buffer. Only after a begin() that was not empty.
  virtual void finish(std::size_t bytes, std::int64_t time_ns) noexcept = 0;
  virtual FileStreamRecord record() const = 0;
};

class FileStreams {
 public:
  virtual ~FileStreams() = default;
  /// Throws SetupError if the folder can not be created. What a stream hands over after the last tick is
  /// lost.
  virtual std::unique_ptr<FileStream> open(const FileStreamOptions& options) = 0;
};

}  // namespace hil::modules
