#include "tests/long/simulated_storage.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <iostream>

namespace hil::long_test {

using rtstdb::DurabilityMode;
using rtstdb::Nanoseconds;
using rtstdb::Result;
using rtstdb::log::DiskCall;
using rtstdb::transaction::CommitLog;
using rtstdb::transaction::CommitLogOptions;

namespace {

constexpr DiskCall all_calls[] = {DiskCall::create,      DiskCall::open,           DiskCall::read,
                                  DiskCall::write,       DiskCall::sync,           DiskCall::size,
                                  DiskCall::preallocate, DiskCall::list,           DiskCall::rename,
                                  DiskCall::remove,      DiskCall::sync_directory, DiskCall::lock};

/// Each advances the clock, and a retry waits for at most a second.
constexpr std::uint64_t max_idle_turns = 100'000;

}  // namespace

void SimulatedStorage::Counts::add(const Counts& other) {
  processes += other.processes;
  killed += other.killed;
  power_lost += other.power_lost;
  failed_opens += other.failed_opens;
  failed_calls += other.failed_calls;
  stalls += other.stalls;
}

SimulatedStorage::SimulatedStorage(std::uint64_t seed, Chance& chance, SimulatedClock& clock)
    : chance_(chance), clock_(clock), disk_(seed), exists_(!chance.one_in(5)) {}

// ---- a process

CommitLogOptions SimulatedStorage::draw_options(std::uint32_t max_entities) {
  constexpr DurabilityMode modes[] = {DurabilityMode::async, DurabilityMode::group, DurabilityMode::sync};
  mode_ = modes[chance_.below(3)];
  CommitLogOptions options;
  options.durability.mode = mode_;
  options.durability.ring_bytes = rtstdb::min_ring_bytes << chance_.below(3);
  options.durability.segment_bytes = rtstdb::min_segment_bytes << chance_.below(4);
  options.durability.checkpoint_every_bytes = chance_.one_in(4) ? 0 : std::uint64_t{4096} << chance_.below(4);
  options.durability.flush_interval = Nanoseconds(std::int64_t{1'000'000} * chance_.below(4));
  options.max_entities = max_entities;
  options.clock = &clock_;
  options.driver = this;
  work_one_in_ = 1u << chance_.below(8);
  stall_one_in_ = chance_.one_in(2) ? 0 : 5 + chance_.below(100);
  calls_to_crash_ = chance_.one_in(2) ? 0 : 1 + chance_.below(400);
  disk_.fail_per_mille(chance_.one_in(2) ? 0 : 1 + chance_.below(100));
  disk_.before_each([this](DiskCall) { before_call(); });
  return options;
}

Result<std::unique_ptr<CommitLog>> SimulatedStorage::open(std::uint32_t max_entities) {
  if (!exists_) return std::unique_ptr<CommitLog>();
  ++counts_.processes;
  const CommitLogOptions options = draw_options(max_entities);
  const auto try_to_open = [&] {
    return CommitLog::open(std::shared_ptr<rtstdb::log::Disk>(std::shared_ptr<void>(), &disk_), options);
  };
  auto opened = try_to_open();
  if (!opened) {
    ++counts_.failed_opens;
    restart();
    opened = try_to_open();
  }
  if (!opened) return opened.error();
  log_ = opened.value().get();
  durable_ = 0;
  note_promises();
  return opened;
}

void SimulatedStorage::before_call() {
  if (calls_to_crash_ != 0 && --calls_to_crash_ == 0) return crash();
  if (stall_one_in_ == 0 || !chance_.one_in(stall_one_in_)) return;
  ++counts_.stalls;
  clock_.advance(Nanoseconds(std::int64_t{1'000} * chance_.below(chance_.one_in(4) ? 2'000'000 : 2'000)));
}

void SimulatedStorage::change_faults() {
  if (log_ == nullptr || has_crashed_ || !chance_.one_in(6)) return;
  clear_faults();
  switch (chance_.below(8)) {
    case 0:
      return disk_.fail_kind(DiskCall::sync, EIO);
    case 1:
      return disk_.fail_kind(DiskCall::write, chance_.one_in(2) ? EIO : ENOSPC);
    case 2:
      return disk_.fail_kind(DiskCall::preallocate, ENOSPC);
    case 3:
      return disk_.set_capacity(chance_.below(400'000));
    case 4:
      return disk_.fail_per_mille(1 + chance_.below(300));
    default:
      return;
  }
}

void SimulatedStorage::clear_faults() {
  fail_all_calls(false);
  disk_.fail_per_mille(0);
  disk_.set_capacity(~std::uint64_t{0});
}

void SimulatedStorage::fail_all_calls(bool refuses) {
  for (const DiskCall call : all_calls)
    disk_.fail_kind(call, refuses ? EIO : 0);
}

// ---- the work of the log

rtstdb::log::Writer::Step SimulatedStorage::work() {
  const auto step = log_->work();
  note_promises();
  return step;
}

void SimulatedStorage::note_promises() {
  if (log_ == nullptr) return;
  const rtstdb::Version durable = log_->durable();
  if (durable < durable_ && fault_.empty())
    fault_ =
        "the durable version went back from " + std::to_string(durable_) + " to " + std::to_string(durable);
  durable_ = durable;
  promised_ = std::max(promised_, durable);
}

void SimulatedStorage::maybe_work() {
  if (log_ != nullptr && chance_.one_in(work_one_in_)) work();
}

void SimulatedStorage::work_or_wait() {
  const auto step = work();
  if (step.worked) {
    idle_turns_ = 0;
    return;
  }
  if (++idle_turns_ > max_idle_turns) {
    std::cerr << "the log does not complete a commit that waits for it\n";
    std::abort();
  }
  const auto now = clock_.now();
  const bool sleeps = step.wake_at != rtstdb::ClockTime::max() && step.wake_at > now;
  clock_.advance(sleeps ? step.wake_at - now : Nanoseconds(100'000));
}

// ---- the end of a process

void SimulatedStorage::crash() {
  if (has_crashed_) return;
  has_crashed_ = true;
  if (chance_.one_in(4)) {
    ++counts_.killed;
    disk_.kill();
  } else {
    ++counts_.power_lost;
    disk_.crash();
  }
  fail_all_calls(true);
}

void SimulatedStorage::note_close() {
  if (log_ == nullptr) return;
  note_promises();
  counts_.failed_calls += log_->state().faults;
  log_ = nullptr;
}

void SimulatedStorage::restart() {
  has_crashed_ = false;
  calls_to_crash_ = 0;
  clear_faults();
}

}  // namespace hil::long_test
