#pragma once
// Work for the engine's thread that is no transaction: a look at the rows, a setup step on the device. It is
// done in steps between transactions, so that urgent work waits for one step at most.

#include "rtstdb/store/store.hpp"
#include "rtstdb/threads/futex.hpp"
#include "rtstdb/transaction/hand_over.hpp"

namespace rtstdb::transaction {

class EngineJob : public HandOverLink {
 public:
  virtual ~EngineJob() = default;
  /// One step, on the engine's thread. True: that was the last.
  virtual bool step(const store::Store& store) noexcept = 0;

  void mark_done() noexcept { state_.set_and_wake(done); }
  void wait() noexcept { state_.wait_while(under_way); }
  bool is_done() const noexcept { return state_.get() == done; }
  /// Given once more, after it was done.
  void begin_anew() noexcept { state_.set(under_way); }

 private:
  static constexpr std::uint32_t under_way = 0;
  static constexpr std::uint32_t done = 1;
  threads::FutexCell state_{under_way};
};

}  // namespace rtstdb::transaction
