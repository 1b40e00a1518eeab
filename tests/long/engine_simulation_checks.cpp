// Checks of outcomes against the model: one serial order of the commits explains every row and every world
// that was read, and the terms and the events allow each outcome.

#include <algorithm>
#include <set>

#include "tests/long/engine_simulation.hpp"

namespace hil::long_test {

using namespace rtstdb;  // NOLINT(google-build-using-namespace): the database under test

namespace {

constexpr std::size_t readable_versions = 16;

bool holds(const ModelRows& rows, EntityId id, Version written_by) {
  const auto found = rows.find(id.index);
  return found != rows.end() && found->second.generation == id.generation &&
         found->second.written_by == written_by;
}

std::string name_of(EntityId id) {
  return "entity " + std::to_string(id.index) + "." + std::to_string(id.generation);
}

}  // namespace

std::string EngineSimulation::describe(const EndedTransaction& ended) {
  return std::string(to_string(ended.declared.terms.deadline_class)) + " transaction of " +
         std::to_string(ended.declared.writes.size()) + " writes and " +
         std::to_string(ended.declared.elements) + " elements, " + rtstdb::describe(ended.outcome) + ": ";
}

void EngineSimulation::fail(const std::string& what) {
  if (!fault_.empty()) return;
  fault_ = "HIL_SIM_SEED=" + std::to_string(seed_) + ", step " + std::to_string(counts_.steps) + ": " + what;
}

void EngineSimulation::check() {
  for (const auto& client : clients_)
    collect(*client);
  std::vector<const EndedTransaction*> commits;
  for (const EndedTransaction& ended : ended_) {
    if (ended.outcome.done() && !ended.declared.writes.empty()) commits.push_back(&ended);
  }
  std::ranges::sort(commits, {}, [](const EndedTransaction* ended) { return ended->outcome.version; });
  for (const EndedTransaction* commit : commits) {
    if (const std::string wrong = model_.commit(commit->outcome.version, commit->declared.writes);
        !wrong.empty())
      return fail(describe(*commit) + wrong);
    committed_.push_back(commit->outcome.version);
  }
  storage_.note_promises();
  for (const EndedTransaction& ended : ended_)
    check_one(ended);
  ended_.clear();
  if (engine_->latest().version != model_.newest())
    fail("the latest version is " + std::to_string(engine_->latest().version) + " and not " +
         std::to_string(model_.newest()));
  check_counts();
  if (!storage_.fault().empty()) fail(storage_.fault());
  if (committed_.size() > readable_versions)
    committed_.erase(committed_.begin(), committed_.end() - readable_versions);
  const bool has_log = engine_->log() != nullptr;
  if (!committed_.empty())
    model_.forget_before(has_log ? std::min(committed_.front(), storage_.promised()) : committed_.front());
  known_.clear();
  for (const auto& [index, row] : model_.rows(model_.newest()))
    known_.push_back({index, row.generation});
}

void EngineSimulation::check_counts() {
  const TransactionCounts counts = engine_->counts();
  if (counts.committed != outcome_counts_[static_cast<std::size_t>(Status::committed)] ||
      counts.missed != outcome_counts_[static_cast<std::size_t>(Status::missed)] ||
      counts.device_lost != outcome_counts_[static_cast<std::size_t>(Status::device_lost)] ||
      counts.firm_late_commits != 0)
    fail("its counts do not agree with the outcomes");
}

void EngineSimulation::check_one(const EndedTransaction& ended) {
  check_durability(ended);
  const auto published = static_cast<std::uint64_t>(ended.outcome.published.time_since_epoch().count());
  counts_.event_hash = (counts_.event_hash + published) * 0x9E3779B97F4A7C15u + ended.outcome.version +
                       static_cast<std::uint64_t>(ended.outcome.status);
  ++counts_.ended[static_cast<std::size_t>(ended.outcome.status)];
  ++outcome_counts_[static_cast<std::size_t>(ended.outcome.status)];
  if (ended.outcome.done())
    check_done(ended);
  else
    check_not_done(ended);
}

void EngineSimulation::check_done(const EndedTransaction& ended) {
  const Outcome& outcome = ended.outcome;
  const DeclaredTransaction& declared = ended.declared;
  const bool writes = !declared.writes.empty();
  const bool reads_latest = !writes && declared.terms.read_at.kind == ReadAt::Kind::latest;
  if ((writes && outcome.version <= declared.newest_before) ||
      (reads_latest && outcome.version < declared.newest_before))
    fail(describe(ended) + "its version is older than the latest one at its submission");
  if (!writes && !reads_latest && outcome.version != declared.terms.read_at.version)
    fail(describe(ended) + "it read another version than its terms give");
  if (outcome.published < ended.last_chunk || outcome.published < declared.submitted)
    fail(describe(ended) + "published before its last chunk or its submission");
  const bool late = outcome.published > declared.terms.deadline;
  if (declared.terms.deadline_class == DeadlineClass::firm && late)
    fail(describe(ended) + "a firm transaction was published late");
  const bool may_be_late = declared.terms.deadline_class == DeadlineClass::hard ||
                           declared.terms.deadline_class == DeadlineClass::soft;
  if (may_be_late && late != (outcome.status == Status::late))
    fail(describe(ended) + "its status and its time of publication do not agree on late");
  if (declared.elements > 0) {
    if (!ended.run || (*ended.run != query::RunStatus::done && *ended.run != query::RunStatus::truncated))
      fail(describe(ended) + "its queries did not run");
    else if (outcome.truncated != (*ended.run == query::RunStatus::truncated))
      fail(describe(ended) + "its outcome and its run do not agree on truncated");
  }
  const Version seen_by_expectations = writes ? model_.before(outcome.version) : outcome.version;
  for (const auto& expected : declared.expected) {
    if (!holds(model_.rows(seen_by_expectations), expected.id, expected.written_by))
      fail(describe(ended) + "its precondition on " + name_of(expected.id) + " does not hold");
  }
  check_reads(ended);
}

void EngineSimulation::check_reads(const EndedTransaction& ended) {
  const Version version = ended.outcome.version;
  for (const auto& observed : ended.observed) {
    ++counts_.observations;
    if (observed.version != version || observed.digest != model_.digest(version))
      fail(describe(ended) + "its queries read another world than version " + std::to_string(version));
  }
  const ModelRows& rows = model_.rows(version);
  for (std::size_t k = 0; k < ended.reads.size(); ++k) {
    const EntityId id = ended.declared.reads[k];
    const auto found = rows.find(id.index);
    const bool alive = found != rows.end() && found->second.generation == id.generation;
    const auto& read = ended.reads[k];
    ++counts_.observations;
    if (alive != read.has_value() ||
        (alive && (read->row.mask != found->second.mask || read->written_by != found->second.written_by)))
      fail(describe(ended) + "its read of " + name_of(id) + " does not agree with version " +
           std::to_string(version));
  }
}

void EngineSimulation::check_not_done(const EndedTransaction& ended) {
  const Outcome& outcome = ended.outcome;
  const DeclaredTransaction& declared = ended.declared;
  const bool firm = declared.terms.deadline_class == DeadlineClass::firm;
  switch (outcome.status) {
    case Status::missed:
      if (!firm || outcome.lateness <= Nanoseconds(0))
        fail(describe(ended) + "it is missed without a firm deadline that passed");
      return;
    case Status::refused:
      return check_refusal(ended);
    case Status::cancelled:
      if (outcome.cancelled_by == CancelledBy::full_queue)
        ++counts_.full_queues;
      else if (outcome.cancelled_by != CancelledBy::caller || !declared.cancelled)
        fail(describe(ended) + "cancelled without a request");
      return;
    case Status::device_lost:
      if (!ended.run && firm)
        ++counts_.lost_while_waiting;
      else if (!ended.run || *ended.run != query::RunStatus::device_lost)
        fail(describe(ended) + "the device was not lost");
      return;
    case Status::conflict:
      return check_conflict(ended);
    case Status::bad_input:
      return check_bad_input(ended);
    default:
      fail(describe(ended) + "unexpected status");
  }
}

void EngineSimulation::check_conflict(const EndedTransaction& ended) {
  const Outcome& outcome = ended.outcome;
  const std::size_t which = outcome.conflict.precondition;
  if (which >= ended.declared.expected.size())
    return fail(describe(ended) + "a conflict without a precondition");
  const auto& expected = ended.declared.expected[which];
  if (holds(model_.rows(outcome.version), expected.id, expected.written_by))
    fail(describe(ended) + "its precondition on " + name_of(expected.id) + " holds");
}

void EngineSimulation::check_bad_input(const EndedTransaction& ended) {
  const BadInput& fault = ended.outcome.bad_input;
  if (fault.reason == BadInputReason::too_many_entities) return;
  if (fault.reason != BadInputReason::unknown_entity ||
      model_.exists_since(fault.entity, ended.declared.newest_before))
    fail(describe(ended) + "its input is valid");
}

void EngineSimulation::check_snapshot() {
  const auto rows = engine_->snapshot(ReadAt::latest());
  if (!rows) return fail("no snapshot: " + rows.error().message);
  const Version latest = engine_->latest().version;
  engine_->call([&] {
    check();
    std::uint64_t sum = 0;
    for (const EntityState& state : rows.value())
      sum += row_digest(state.id, state.row.mask, state.written_by);
    if (sum != model_.digest(latest))
      fail("a snapshot of version " + std::to_string(latest) + " shows another world than the model");
  });
}

}  // namespace hil::long_test
