#pragma once
// The jobs that wait for the engine thread, oldest first.
//
// Threads: give by any; all else by the engine's.

#include "rtstdb/scheduler/hand_over.hpp"
#include "rtstdb/transaction/engine_job.hpp"

namespace rtstdb::transaction {

class JobQueue {
 public:
  /// False: the queue is closed, and the job stays the caller's.
  bool give(EngineJob& job) noexcept { return given_.push(job); }

  /// The oldest job, or null.
  EngineJob* oldest() noexcept {
    if (taken_ == nullptr) taken_ = given_.take_all();
    return static_cast<EngineJob*>(taken_);
  }
  /// Does one step of the oldest job. Misuse when there is none.
  void step(const store::Store& store) noexcept {
    EngineJob& job = *static_cast<EngineJob*>(taken_);
    if (!job.step(store)) return;
    taken_ = job.next;
    job.mark_done();
  }
  /// Does all jobs and takes no more.
  void finish(const store::Store& store) noexcept {
    while (oldest() != nullptr)
      step(store);
    taken_ = given_.close();
    while (taken_ != nullptr)
      step(store);
  }

 private:
  scheduler::HandOver given_;
  scheduler::HandOverLink* taken_ = nullptr;
};

}  // namespace rtstdb::transaction
