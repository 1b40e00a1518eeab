// Checks of durability: the outcome of each transaction, and the version that is recovered.

#include <algorithm>

#include "tests/long/engine_simulation.hpp"

namespace hil::long_test {

using namespace rtstdb;  // NOLINT(google-build-using-namespace): the database under test

/// The recovered version was committed or in doubt, and is not before the durable version.
void EngineSimulation::check_recovery(Version found) {
  ++counts_.recovered;
  const Version newest = model_.newest();
  const Version promised = model_.before(storage_.promised() + 1);
  const std::string at = "version " + std::to_string(found) + " was recovered; ";
  if (found < promised) fail(at + "the durable version is " + std::to_string(promised));
  if (must_recover_all_ && found < newest) fail(at + "the last commit is version " + std::to_string(newest));
  if (const std::string wrong = model_.recover_at(found); !wrong.empty()) return fail(at + wrong);
  if (found < newest) ++counts_.processes_with_losses;
  if (found > newest) ++counts_.recovered_doubts;
  must_recover_all_ = false;
  storage_.recover_at(found);
}

void EngineSimulation::check_durability(const EndedTransaction& ended) {
  const Outcome& outcome = ended.outcome;
  const DurabilityMode mode = storage_.mode();
  const bool waits = mode == DurabilityMode::group || mode == DurabilityMode::sync;
  const bool written = outcome.done() && !ended.declared.writes.empty();
  if (outcome.durable && (!waits || !written)) fail(describe(ended) + "durable without a wait for the disk");
  if (outcome.durable && outcome.version > storage_.promised())
    fail(describe(ended) + "durable, and after the durable version of the log");
  if (outcome.durable && outcome.durable_at < outcome.published)
    fail(describe(ended) + "durable before it was published");
  const bool last_write_failed = engine_->log() != nullptr && engine_->log()->state().faults > 0;
  if (written && waits && !outcome.durable && (mode == DurabilityMode::sync || !last_write_failed))
    fail(describe(ended) + "completed before it was durable");
  if (written && waits) ++(outcome.durable ? counts_.durable : counts_.not_durable);
  if (!outcome.in_doubt) return;
  if (mode != DurabilityMode::sync || outcome.done())
    fail(describe(ended) + "in doubt in another mode than sync, or committed");
  ++counts_.in_doubt;
  model_.note_in_doubt(outcome.version, ended.declared.writes);
}

void EngineSimulation::check_refusal(const EndedTransaction& ended) {
  const Outcome& outcome = ended.outcome;
  const bool firm = ended.declared.terms.deadline_class == DeadlineClass::firm;
  ++counts_.refused[static_cast<std::size_t>(outcome.refused_by)];
  switch (outcome.refused_by) {
    case RefusedBy::admission:
      if (!firm || outcome.earliest_feasible <= ended.declared.terms.deadline)
        fail(describe(ended) + "refused, and its deadline is feasible");
      return;
    case RefusedBy::log_full:
    case RefusedBy::log_fault:
      if (storage_.mode() != DurabilityMode::group && storage_.mode() != DurabilityMode::sync)
        fail(describe(ended) + "refused by the log in a mode that does not wait for it");
      if (ended.declared.writes.empty()) fail(describe(ended) + "refused by the log without writes");
      return;
    default:
      fail(describe(ended) + "refused without a reason");
  }
}

}  // namespace hil::long_test
