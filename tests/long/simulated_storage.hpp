#pragma once
// A disk and the log on it, one life of the database after the other: by the seed the log is in one mode or
// another, has its turn now and then, and the disk refuses, is full, stands still, and loses what was not
// synced when the power goes.
//
// The log has no thread of its own here: it does its work where the simulation gives it a turn.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include <rtstdb/durability.hpp>

#include "rtstdb/transaction/commit_log.hpp"
#include "tests/support/simulation/device.hpp"
#include "tests/support/simulation/disk.hpp"

namespace hil::stress {

class SimulatedStorage final : public rtstdb::transaction::LogDriver {
 public:
  SimulatedStorage(std::uint64_t seed, Chance& chance, SimulatedClock& clock);

  /// Draws how the next life is to be and opens the log: null where this machine has no disk. The fault in
  /// words where a disk that does what it should can not be opened.
  rtstdb::Result<std::unique_ptr<rtstdb::transaction::CommitLog>> open(std::uint32_t max_entities);
  /// Of the life that was opened last.
  rtstdb::DurabilityMode mode() const noexcept { return mode_; }

  /// By chance the log has its turn.
  void give_turn();
  /// By chance the disk becomes better or worse.
  void change_weather();
  /// What is held is given back by that: the log has turns until it does, and time passes. Once without
  /// anything that runs.
  void work_on();
  void log_is_waited_for() noexcept override { work_on(); }

  /// The process is killed, or the power goes: nothing that is called any more reaches the disk.
  void end_at_once();
  bool has_ended() const noexcept { return has_ended_; }
  /// The engine is gone: the next one may have the disk.
  void rest();

  /// Every version up to this one was said to be on disk.
  rtstdb::Version promised() const noexcept { return promised_; }
  /// Of the log, now, too.
  void note_promises();
  /// The engine is about to go.
  void note_last_words();
  /// The world is at that version now: nothing else is promised.
  void goes_on_at(rtstdb::Version version) noexcept { promised_ = version; }
  /// Something that the log itself may never do; else empty.
  const std::string& fault() const noexcept { return fault_; }

  struct Counts {
    std::uint64_t lives = 0, killed = 0, power_lost = 0, not_opened = 0;
    std::uint64_t refused_calls = 0, stalls = 0;
    bool operator==(const Counts&) const = default;
    void add(const Counts& other);
  };
  const Counts& counts() const noexcept { return counts_; }

 private:
  rtstdb::transaction::CommitLogOptions draw_life(std::uint32_t max_entities);
  void before_call();
  rtstdb::log::Writer::Step work();
  void refuse_everything(bool refuses);
  void clear_up();

  Chance& chance_;
  SimulatedClock& clock_;
  test::SimulatedDisk disk_;
  const bool exists_;
  rtstdb::DurabilityMode mode_ = rtstdb::DurabilityMode::volatile_only;
  rtstdb::transaction::CommitLog* log_ = nullptr;

  std::uint32_t one_turn_in_ = 1;
  std::uint32_t one_stall_in_ = 0;  ///< calls; 0: none
  std::uint32_t calls_to_end_ = 0;  ///< 0: the disk does not end this life
  bool has_ended_ = false;
  std::uint64_t idle_turns_ = 0;  ///< in a row
  rtstdb::Version promised_ = 0, durable_ = 0;
  std::string fault_;
  Counts counts_;
};

}  // namespace hil::stress
