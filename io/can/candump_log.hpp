#pragma once
// Logs of bus traffic in the format of `candump -l` (candump_line.hpp).

#include <condition_variable>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "io/can/candump_line.hpp"
#include "io/can/frame.hpp"

namespace hil::io::can {

struct CandumpLog {
  std::vector<LoggedFrame> frames;
  std::vector<std::size_t> bad_lines;  ///< line numbers from 1; empty lines are allowed
  std::string fault;                   ///< why the file can not be read; empty: it was read
};
CandumpLog read_candump_log(const std::filesystem::path& file);

/// Writes a log in an ordinary thread of its own.
///
/// Threads: one thread calls push; any thread calls the others. push holds a lock only to move frames.
class CandumpLogWriter {
 public:
  enum class WhenFull : std::uint8_t {
    drop,  ///< push never waits; when the queue is full, the frame is dropped and counted
    wait,  ///< push waits until the queue has space, so nothing is lost (virtual clock)
  };

  /// Throws DeviceError when the file can not be created. `capacity`: frames in the queue.
  CandumpLogWriter(const std::filesystem::path& file, std::string interface, WhenFull when_full,
                   std::size_t capacity = 65536);
  ~CandumpLogWriter() { close(); }
  CandumpLogWriter(const CandumpLogWriter&) = delete;
  CandumpLogWriter& operator=(const CandumpLogWriter&) = delete;

  /// Misuse (asserts): after close.
  void push(const Frame& frame);
  /// Writes the queued frames and closes the file. Idempotent. Called by the thread that pushes.
  void close() noexcept;

  std::uint64_t dropped() const;
  /// The first write error (disk full) as a sentence; frames after it are lost and counted as dropped. After
  /// close also: another program changed the file. Empty: none.
  std::string fault() const;

 private:
  /// From this many queued frames on, the writer stops collecting a batch.
  std::size_t batch_limit() const noexcept { return (capacity_ + 1) / 2; }
  void run();
  bool write(const std::vector<Frame>& frames, std::string& text);

  const std::string file_name_;
  const std::string interface_;
  const WhenFull when_full_;
  const std::size_t capacity_;
  std::FILE* stream_;        ///< opened for appending, which reveals that another program truncated the file
  std::uint64_t bytes_ = 0;  ///< written

  mutable std::mutex mutex_;
  std::condition_variable has_frames_;
  std::condition_variable space_available_;
  std::vector<Frame> waiting_;
  bool closing_ = false;
  std::uint64_t dropped_ = 0;
  std::string fault_;

  std::thread thread_;
};

}  // namespace hil::io::can
