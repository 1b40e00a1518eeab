#pragma once
// Keeps what a child process prints, up to a limit: the first part goes into a file, then a sentence says
// that the rest was left out. The child never notices: an ordinary thread reads on and throws away, so that
// no program fills a disk, ends for want of a reader, or waits for one.
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

  /// Replaces the file. When it can not be written, or there is no pipe: open() is false, errno says why.
  explicit OutputKeeper(const std::filesystem::path& file);
  ~OutputKeeper() { finish(); }
  OutputKeeper(const OutputKeeper&) = delete;
  OutputKeeper& operator=(const OutputKeeper&) = delete;

  bool open() const noexcept { return file_.get() >= 0 && into_.get() >= 0; }
  /// Where the child writes; closed by begin().
  int input_fd() const noexcept { return into_.get(); }
  /// Once the child has its descriptors: reads from now on. False: there is no thread to be had; errno says
  /// why.
  bool begin();
  /// Takes in what has been printed so far, and ends. What is printed later has no reader.
  void finish() noexcept;
  /// After finish(): why the file lacks some of what was printed, in a sentence: it could not be written, or
  /// another program changed it. Empty: it lacks nothing, or only what is beyond the limit.
  std::string fault() const;

 private:
  void serve() noexcept;
  /// At most `max_bytes`, as long as there is something. False: nobody can print any more.
  bool take(std::size_t max_bytes) noexcept;
  void keep(const char* bytes, std::size_t count) noexcept;

  const std::string file_name_;
  int write_error_ = 0;        ///< the first one
  std::uint64_t written_ = 0;  ///< bytes; the file is opened to append
  bool was_cut_ = false;
  Descriptor file_;
  Descriptor from_, into_;  ///< the ends of the pipe
  Descriptor wake_;
  std::size_t room_ = kept_bytes;
  bool left_out_ = false;
  std::atomic<bool> finishing_{false};
  std::thread thread_;
};

}  // namespace hil::io::process
