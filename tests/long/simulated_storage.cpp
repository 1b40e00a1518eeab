#include "tests/long/simulated_storage.hpp"

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <iostream>

namespace hil::stress {

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

/// The longest that a retry waits is a second: nothing is waited for longer.
constexpr std::uint64_t max_idle_turns = 100'000;

}  // namespace

void SimulatedStorage::Counts::add(const Counts& other) {
  lives += other.lives;
  killed += other.killed;
  power_lost += other.power_lost;
  not_opened += other.not_opened;
  refused_calls += other.refused_calls;
  stalls += other.stalls;
}

SimulatedStorage::SimulatedStorage(std::uint64_t seed, Chance& chance, SimulatedClock& clock)
    : chance_(chance), clock_(clock), disk_(seed), exists_(!chance.one_in(5)) {}

// ---- a life

CommitLogOptions SimulatedStorage::draw_life(std::uint32_t max_entities) {
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
  one_turn_in_ = 1u << chance_.below(8);
  one_stall_in_ = chance_.one_in(2) ? 0 : 5 + chance_.below(100);
  calls_to_end_ = chance_.one_in(2) ? 0 : 1 + chance_.below(400);
  disk_.fail_per_mille(chance_.one_in(2) ? 0 : 1 + chance_.below(100));
  disk_.before_each([this](DiskCall) { before_call(); });
  return options;
}

Result<std::unique_ptr<CommitLog>> SimulatedStorage::open(std::uint32_t max_entities) {
  if (!exists_) return std::unique_ptr<CommitLog>();
  ++counts_.lives;
  const CommitLogOptions options = draw_life(max_entities);
  const auto try_to_open = [&] {
    return CommitLog::open(std::shared_ptr<rtstdb::log::Disk>(std::shared_ptr<void>(), &disk_), options);
  };
  auto opened = try_to_open();
  if (!opened) {
    ++counts_.not_opened;
    rest();
    opened = try_to_open();
  }
  if (!opened) return opened.error();
  log_ = opened.value().get();
  durable_ = 0;
  note_promises();
  return opened;
}

void SimulatedStorage::before_call() {
  if (calls_to_end_ != 0 && --calls_to_end_ == 0) return end_at_once();
  if (one_stall_in_ == 0 || !chance_.one_in(one_stall_in_)) return;
  ++counts_.stalls;
  clock_.advance(Nanoseconds(std::int64_t{1'000} * chance_.below(chance_.one_in(4) ? 2'000'000 : 2'000)));
}

void SimulatedStorage::change_weather() {
  if (log_ == nullptr || has_ended_ || !chance_.one_in(6)) return;
  clear_up();
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

void SimulatedStorage::clear_up() {
  refuse_everything(false);
  disk_.fail_per_mille(0);
  disk_.set_capacity(~std::uint64_t{0});
}

void SimulatedStorage::refuse_everything(bool refuses) {
  for (const DiskCall call : all_calls)
    disk_.fail_kind(call, refuses ? EIO : 0);
}

// ---- the log's turns

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
        "the watermark went back from version " + std::to_string(durable_) + " to " + std::to_string(durable);
  durable_ = durable;
  promised_ = std::max(promised_, durable);
}

void SimulatedStorage::give_turn() {
  if (log_ != nullptr && chance_.one_in(one_turn_in_)) work();
}

void SimulatedStorage::work_on() {
  const auto step = work();
  if (step.worked) {
    idle_turns_ = 0;
    return;
  }
  if (++idle_turns_ > max_idle_turns) {
    std::cerr << "somebody waits for the log for ever\n";
    std::abort();
  }
  const auto now = clock_.now();
  const bool sleeps = step.wake_at != rtstdb::ClockTime::max() && step.wake_at > now;
  clock_.advance(sleeps ? step.wake_at - now : Nanoseconds(100'000));
}

// ---- its end

void SimulatedStorage::end_at_once() {
  if (has_ended_) return;
  has_ended_ = true;
  if (chance_.one_in(4)) {
    ++counts_.killed;
    disk_.kill();
  } else {
    ++counts_.power_lost;
    disk_.crash();
  }
  refuse_everything(true);
}

void SimulatedStorage::note_last_words() {
  if (log_ == nullptr) return;
  note_promises();
  counts_.refused_calls += log_->state().faults;
  log_ = nullptr;
}

void SimulatedStorage::rest() {
  has_ended_ = false;
  calls_to_end_ = 0;
  clear_up();
}

}  // namespace hil::stress
