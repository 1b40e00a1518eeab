// What is said of durability, transaction by transaction, and what is there when the database is opened
// again.

#include <algorithm>

#include "tests/long/engine_simulation.hpp"

namespace hil::stress {

using namespace rtstdb;  // NOLINT(google-build-using-namespace): the database that is driven

/// A life ended, in whatever way: the world that was found was, and is not before what was promised.
void EngineSimulation::judge_recovery(Version found) {
  ++counts_.recovered;
  const Version newest = model_.newest();
  const Version promised = model_.before(storage_.promised() + 1);
  const std::string at = "version " + std::to_string(found) + " was found; ";
  if (found < promised) fail(at + "promised was " + std::to_string(promised));
  if (must_find_all_ && found < newest) fail(at + "nothing may be lost of " + std::to_string(newest));
  if (const std::string wrong = model_.go_on_at(found); !wrong.empty()) return fail(at + wrong);
  if (found < newest) ++counts_.losing_lives;
  if (found > newest) ++counts_.doubts_that_stood;
  must_find_all_ = false;
  storage_.goes_on_at(found);
}

void EngineSimulation::judge_durability(const EndedTransaction& ended) {
  const Outcome& outcome = ended.outcome;
  const DurabilityMode mode = storage_.mode();
  const bool waits = mode == DurabilityMode::group || mode == DurabilityMode::sync;
  const bool written = outcome.done() && !ended.declared.writes.empty();
  if (outcome.durable && (!waits || !written)) fail(describe(ended) + "nothing of it waited for the disk");
  if (outcome.durable && outcome.version > storage_.promised())
    fail(describe(ended) + "said to be on disk, and the log says that it is not");
  if (outcome.durable && outcome.durable_at < outcome.published)
    fail(describe(ended) + "on disk before it was published");
  const bool last_write_failed = engine_->log() != nullptr && engine_->log()->state().faults > 0;
  if (written && waits && !outcome.durable && (mode == DurabilityMode::sync || !last_write_failed))
    fail(describe(ended) + "given back before it was on disk");
  if (written && waits) ++(outcome.durable ? counts_.durable : counts_.not_durable);
  if (!outcome.in_doubt) return;
  if (mode != DurabilityMode::sync || outcome.done()) fail(describe(ended) + "there is nothing to doubt");
  ++counts_.in_doubt;
  model_.may_stand(outcome.version, ended.declared.writes);
}

void EngineSimulation::judge_refusal(const EndedTransaction& ended) {
  const Outcome& outcome = ended.outcome;
  const bool firm = ended.declared.terms.deadline_class == DeadlineClass::firm;
  ++counts_.refused[static_cast<std::size_t>(outcome.refused_by)];
  switch (outcome.refused_by) {
    case RefusedBy::admission:
      if (!firm || outcome.earliest_feasible <= ended.declared.terms.deadline)
        fail(describe(ended) + "refused, and what was asked for is feasible");
      return;
    case RefusedBy::log_full:
    case RefusedBy::log_fault:
      if (storage_.mode() != DurabilityMode::group && storage_.mode() != DurabilityMode::sync)
        fail(describe(ended) + "the loop goes first");
      if (ended.declared.writes.empty()) fail(describe(ended) + "it has nothing for the log");
      return;
    default:
      fail(describe(ended) + "refused by nobody");
  }
}

}  // namespace hil::stress
