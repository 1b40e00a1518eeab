#pragma once
// A disk and the log on it, for one process after the other. A seed gives the durability mode, the times at
// which the log works, disk faults, a full disk, stalls, and power failures that lose unsynced data.
//
// The log has no thread here: it works in maybe_work() and work_or_wait().

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <rtstdb/durability.hpp>

#include "rtstdb/transaction/commit_log.hpp"
#include "tests/support/simulation/device.hpp"
#include "tests/support/simulation/disk.hpp"

namespace hil::long_test {

class SimulatedStorage final : public rtstdb::transaction::LogDriver {
 public:
  SimulatedStorage(std::uint64_t seed, Chance& chance, SimulatedClock& clock);

  /// Draws the options of the next process and opens the log: null on a machine without a disk. An error when
  /// a disk without faults can not be opened.
  rtstdb::Result<std::unique_ptr<rtstdb::transaction::CommitLog>> open(std::uint32_t max_entities);
  /// Of the current process.
  rtstdb::DurabilityMode mode() const noexcept { return mode_; }

  /// At random, the log works.
  void maybe_work();
  /// At random, disk faults begin or end.
  void change_faults();
  /// The log works once; when it has nothing to do, time passes until it has.
  void work_or_wait();
  void log_is_waited_for() noexcept override { work_or_wait(); }

  /// Kills the process or cuts the power. All later calls fail.
  void crash();
  bool has_crashed() const noexcept { return has_crashed_; }
  /// After the engine is destroyed: the next process may open the disk.
  void restart();

  /// The newest version that the log reported as durable.
  rtstdb::Version promised() const noexcept { return promised_; }
  /// Reads the durable version of the log.
  void note_promises();
  /// Before the engine is destroyed.
  void note_close();
  /// After recovery: nothing after that version is durable.
  void recover_at(rtstdb::Version version) noexcept { promised_ = version; }
  /// A broken rule of the log; empty: none.
  const std::string& fault() const noexcept { return fault_; }

  struct Counts {
    std::uint64_t processes = 0, killed = 0, power_lost = 0, failed_opens = 0;
    std::uint64_t failed_calls = 0, stalls = 0;
    bool operator==(const Counts&) const = default;
    void add(const Counts& other);
  };
  const Counts& counts() const noexcept { return counts_; }

 private:
  rtstdb::transaction::CommitLogOptions draw_options(std::uint32_t max_entities);
  void before_call();
  rtstdb::log::Writer::Step work();
  void fail_all_calls(bool refuses);
  void clear_faults();

  Chance& chance_;
  SimulatedClock& clock_;
  tests::SimulatedDisk disk_;
  const bool exists_;
  rtstdb::DurabilityMode mode_ = rtstdb::DurabilityMode::volatile_only;
  rtstdb::transaction::CommitLog* log_ = nullptr;

  std::uint32_t work_one_in_ = 1;
  std::uint32_t stall_one_in_ = 0;    ///< calls; 0: none
  std::uint32_t calls_to_crash_ = 0;  ///< 0: no crash in a disk call
  bool has_crashed_ = false;
  std::uint64_t idle_turns_ = 0;  ///< without work between them
  rtstdb::Version promised_ = 0, durable_ = 0;
  std::string fault_;
  Counts counts_;
};

}  // namespace hil::long_test
