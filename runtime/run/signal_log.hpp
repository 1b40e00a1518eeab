#pragma once
// signals.csv: all signals at a fixed rate. The tick fills rows of a preallocated ring; an ordinary thread
// writes them. When the ring is full, the row is lost and counted; under the virtual clock the tick writes
// the rows of a full ring, so that none is lost.
//
// First line: "time_s" and the names of the signals, in quotes where they contain a comma. Numbers are the
// shortest that read back as the same double.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "runtime/signals/signal_table.hpp"

namespace hil::run {

class SignalLog {
 public:
  /// Throws io::DeviceError when the file can not be created.
  SignalLog(const std::filesystem::path& file, const signals::SignalTable& table, bool virtual_clock);
  ~SignalLog();
  SignalLog(const SignalLog&) = delete;
  SignalLog& operator=(const SignalLog&) = delete;

  /// Base thread. Under the real-time clock it neither blocks nor allocates.
  void take(const signals::SignalTable& table, std::int64_t time_ns) noexcept;
  /// Writes the remaining rows and closes the file. Returns a sentence when the file is incomplete, since
  /// it could not be written or another program changed it; else empty.
  std::string close();
  std::uint64_t lost_rows() const noexcept { return lost_.load(); }

 private:
  void serve();
  void drain();
  void write_text();

  static constexpr std::size_t ring_rows = 512;
  const std::filesystem::path path_;
  const std::size_t columns_;  // values of a row, without its time
  const bool virtual_clock_;
  std::vector<double> ring_;  // ring_rows rows of columns_
  std::vector<std::int64_t> times_ns_;
  std::atomic<std::uint64_t> written_{0}, read_{0};
  std::atomic<std::uint64_t> lost_{0};
  std::atomic<bool> stopping_{false};
  std::ofstream file_;  ///< appends, so that a file that another program cut is shorter than bytes_
  std::uint64_t bytes_ = 0;
  std::string text_;
  std::thread thread_;
};

}  // namespace hil::run
