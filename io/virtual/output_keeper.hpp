#pragma once
// Keeps the output of a child process up to a limit: the first part goes into a file, followed by a sentence
// that the rest was omitted. An ordinary thread keeps reading and discards the rest, so that no program fills
// a disk, ends for lack of a reader, or blocks on its output.
//
// Threads: one at a time.

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <thread>

#include "io/virtual/descriptor.hpp"

namespace hil::io::process {

class OutputKeeper {
 public:
  static constexpr std::size_t kept_bytes = std::size_t{16} << 20U;

  /// Replaces the file. open() is false, with the reason in errno, when the file or the pipe can not be
  /// created.
  explicit OutputKeeper(const std::filesystem::path& file);
  ~OutputKeeper() { finish(); }
  OutputKeeper(const OutputKeeper&) = delete;
  OutputKeeper& operator=(const OutputKeeper&) = delete;

  bool open() const noexcept { return file_.get() >= 0 && into_.get() >= 0; }
  /// The child's end of the pipe; closed by begin().
  int input_fd() const noexcept { return into_.get(); }
  /// Starts reading, once the child has its descriptors. False: the thread can not be created; errno holds
  /// the reason.
  bool begin();
  /// Takes the output so far and stops. Later output has no reader.
  void finish() noexcept;
  /// After finish(): why the file lacks a part of the output, as a sentence: it could not be written, or
  /// another program changed it. Empty: it lacks nothing but what exceeds the limit.
  std::string fault() const;

 private:
  void serve() noexcept;
  /// Reads at most `max_bytes` of what is available. False: all writers have closed the pipe.
  bool take(std::size_t max_bytes) noexcept;
  void keep(const char* bytes, std::size_t count) noexcept;

  const std::string file_name_;
  int write_error_ = 0;        ///< the first one
  std::uint64_t written_ = 0;  ///< bytes; the file is opened to append
  bool was_cut_ = false;
  Descriptor file_;
  Descriptor from_, into_;  ///< the ends of the pipe
  Descriptor wake_;
  std::size_t remaining_bytes_ = kept_bytes;
  bool left_out_ = false;
  std::atomic<bool> finishing_{false};
  std::thread thread_;
};

}  // namespace hil::io::process
