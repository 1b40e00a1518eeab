#pragma once
// Work for the engine thread that is no transaction: a look at the rows, a setup step on the device. It is
// done in steps between transactions, so that a transaction waits for one step at most.

#include "rtstdb/scheduler/hand_over.hpp"
#include "rtstdb/store/store.hpp"
#include "rtstdb/threads/futex.hpp"

namespace rtstdb::transaction {

class EngineJob : public scheduler::HandOverLink {
 public:
  virtual ~EngineJob() = default;
  /// The engine thread: one step. True: it was the last.
  virtual bool step(const store::Store& store) noexcept = 0;

  // Any thread.
  void wait() noexcept { state_.wait_while(in_progress); }
  bool is_done() const noexcept { return state_.get() == done; }
  /// The thread that called the last step; the job may be destroyed as soon as its owner sees this.
  void mark_done() noexcept { state_.set_and_wake(done); }
  /// The owner, once it is done: the job may be given again.
  void begin_anew() noexcept { state_.set(in_progress); }

 private:
  static constexpr std::uint32_t in_progress = 0;
  static constexpr std::uint32_t done = 1;
  threads::FutexCell state_{in_progress};
};

/// Takes jobs and has them done on the engine thread.
class JobTaker {
 public:
  virtual ~JobTaker() = default;
  /// Any thread. The job is done some time later, also when the engine has ended.
  virtual void take_job(EngineJob& job) noexcept = 0;
};

}  // namespace rtstdb::transaction
