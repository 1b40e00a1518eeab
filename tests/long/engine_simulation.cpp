#include "tests/long/engine_simulation.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace hil::long_test {

using namespace rtstdb;  // NOLINT(google-build-using-namespace): the database under test

namespace {

constexpr std::size_t clients = 40;
constexpr std::uint32_t queue_capacity = 12;
constexpr std::uint32_t max_entities = 48;
constexpr std::uint32_t max_elements = 40'000;
constexpr std::uint32_t rounds_of_a_process = 12;  // on average

std::uint64_t digest_of(const store::RowSource& rows) {
  std::uint64_t sum = 0;
  for (std::uint32_t index = 0; index < rows.index_limit(); ++index) {
    const EntityState* state = rows.row(index);
    if (state != nullptr) sum += row_digest(state->id, state->row.mask, state->written_by);
  }
  return sum;
}

}  // namespace

/// Its chunks read all rows.
class EngineSimulation::Query final : public RayQuery, public query::PreparedQuery {
 public:
  explicit Query(Client& client_given) : client(client_given) {}
  std::span<Ray> rays() noexcept override { return {}; }
  std::span<const RayHit> hits() const noexcept override { return {}; }
  query::CostClass cost_class() const noexcept override { return query::CostClass::ray_closest; }
  std::uint32_t capacity() const noexcept override { return max_elements; }
  std::optional<BadInput> check(std::uint32_t, const store::RowSource& rows,
                                store::TimeSpan& times) const noexcept override {
    times = {rows.time(), rows.time()};
    return std::nullopt;
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }
  std::uint32_t answered() const noexcept override { return 0; }
  std::uint32_t incomplete(std::uint32_t) const noexcept override { return 0; }
  bool truncated() const noexcept override { return is_truncated; }
  void publish_answers(std::uint32_t, std::uint32_t) noexcept override {}
  void discard_answers() noexcept override {}

  Client& client;
  bool is_truncated = false;
};

struct EngineSimulation::Client {
  std::unique_ptr<Transaction> transaction;
  Query query{*this};
  EndedTransaction now;
  bool uncollected = false;  // submitted, and its outcome not collected
  bool pending() const { return transaction->status() == Status::pending; }
};

void SimulationCounts::add(const SimulationCounts& other) {
  steps += other.steps;
  for (std::size_t k = 0; k < ended.size(); ++k)
    ended[k] += other.ended[k];
  nested_runs += other.nested_runs;
  losses += other.losses;
  losses_in_nested_runs += other.losses_in_nested_runs;
  lost_while_waiting += other.lost_while_waiting;
  commits_by_write_helper += other.commits_by_write_helper;
  full_queues += other.full_queues;
  observations += other.observations;
  for (std::size_t k = 0; k < refused.size(); ++k)
    refused[k] += other.refused[k];
  durable += other.durable;
  not_durable += other.not_durable;
  in_doubt += other.in_doubt;
  recovered_doubts += other.recovered_doubts;
  recovered += other.recovered;
  closed += other.closed;
  processes_with_losses += other.processes_with_losses;
  gaps += other.gaps;
  storage.add(other.storage);
}

EngineSimulation::EngineSimulation(std::uint64_t seed)
    : seed_(seed), chance_(seed), storage_(seed, chance_, clock_) {}

EngineSimulation::~EngineSimulation() = default;

std::string EngineSimulation::run(std::uint64_t steps) {
  const std::uint64_t end = counts_.steps + steps;
  while (counts_.steps < end && fault_.empty()) {
    begin_process();
    for (process_ends_ = false; !process_ends_ && counts_.steps < end && fault_.empty();) {
      engine_->call([&] { run_round(); });
      wait_until_idle();
      finish_log_work();
      if (checks_snapshot_) check_snapshot();
      process_ends_ = process_ends_ || storage_.has_crashed();
    }
    end_process();
  }
  if (fault_.empty()) begin_process();  // checks the recovery after the last end
  end_process();
  counts_.storage = storage_.counts();
  return fault_;
}

void EngineSimulation::run_round() {
  check();
  clock_.advance(Nanoseconds(chance_.below(200'000)));
  storage_.change_faults();
  storage_.maybe_work();
  submit_some(12);
  checks_snapshot_ = chance_.one_in(8);
  process_ends_ = chance_.one_in(rounds_of_a_process);
  device_.retry();
}

// ---- one process after the other

void EngineSimulation::begin_process() {
  auto log = storage_.open(max_entities);
  if (!log) return fail("the log can not be opened: " + log.error().message);
  const bool has_log = log.value() != nullptr;
  if (has_log) {
    check_recovery(log.value()->recovery().version);
  } else {
    model_ = {};
  }
  transaction::EngineOptions options;
  options.store.max_entities = max_entities;
  options.store.retained_changes = 1u << 14;
  options.store.geometry_known = [](GeometryId id) { return !id.valid(); };
  options.queue_capacity = queue_capacity;
  options.chunk = Nanoseconds(1'000'000);
  engine_ =
      std::make_unique<transaction::Engine>(std::move(options), device_, clock_, std::move(log).value());
  for (std::size_t k = 0; k <= clients; ++k) {
    auto client = std::make_unique<Client>();
    client->transaction = engine_->make_transaction(
        {.max_writes = 6, .max_preconditions = 3, .max_queries = 1, .max_reads = 4});
    clients_.push_back(std::move(client));
  }
  probe_ = clients_.back().get();
  outcome_counts_ = {};
  committed_.clear();
  if (model_.newest() != 0) committed_.push_back(model_.newest());
  check_snapshot();
}

void EngineSimulation::end_process() {
  if (engine_ == nullptr) return;
  engine_->call([&] { check(); });
  clock_.cancel_jump();
  clients_.clear();
  if (engine_->log() != nullptr && chance_.one_in(2)) storage_.crash();
  must_recover_all_ = storage_.mode() == DurabilityMode::sync;
  engine_->close();
  if (transaction::CommitLog* const log = engine_->log()) {
    const bool closed = log->close().ok();
    must_recover_all_ = must_recover_all_ || closed;
    counts_.closed += closed;
    counts_.gaps += log->state().gaps;
  }
  storage_.note_close();
  engine_.reset();
  storage_.restart();
}

/// Only commits that the log holds are pending, and the engine does not retry the device. The count of
/// submissions is read first and last, since transactions that end between these reads may submit others.
bool EngineSimulation::is_idle() const {
  const std::uint64_t submissions = submissions_;
  const auto pending = std::ranges::count_if(clients_, [](const auto& client) { return client->pending(); });
  const bool idle = !device_.will_be_retried() && pending == held();
  return idle && submissions == submissions_;
}

std::uint32_t EngineSimulation::held() const {
  return engine_->log() != nullptr ? engine_->log()->held() : 0;
}

void EngineSimulation::wait_until_idle() {
  while (!is_idle())
    std::this_thread::sleep_for(std::chrono::microseconds(20));
}

/// Step by step: between two steps the engine copies the world for a checkpoint.
void EngineSimulation::finish_log_work() {
  while (held() > 0)
    engine_->call([&] { storage_.work_or_wait(); });
}

// ---- events of the device

void EngineSimulation::run_begins(std::span<const query::Request> requests) {
  if (!running_.empty()) ++counts_.nested_runs;
  std::vector<Client*>& together = running_.emplace_back();
  for (const query::Request& request : requests) {
    auto& query = static_cast<Query&>(*request.query);
    query.is_truncated = false;
    together.push_back(&query.client);
  }
}

bool EngineSimulation::chunk_done(const store::RowSource& rows, const query::PreparedQuery& query,
                                  bool last) {
  ++counts_.steps;
  Client& client = static_cast<const Query&>(query).client;
  if (std::ranges::find(running_.back(), &client) == running_.back().end())
    fail("a chunk of a query that does not run");
  client.now.observed.push_back({rows.version(), digest_of(rows)});
  client.now.last_chunk = clock_.now();
  storage_.maybe_work();
  if (chance_.one_in(2)) submit_some(3);
  if (chance_.one_in(6)) cancel_one();
  if (chance_.one_in(300)) {
    ++counts_.losses;
    if (running_.size() > 1) ++counts_.losses_in_nested_runs;
    return true;
  }
  // The clock jumps between the completion of the run and the publication.
  if (last && running_.size() == 1 && chance_.one_in(8))
    clock_.jump_before_reading(2, Nanoseconds(chance_.below(3'000'000)));
  return false;
}

void EngineSimulation::run_ends(query::RunStatus status) {
  for (Client* const client : running_.back()) {
    client->now.run = status;
    client->query.is_truncated = status == query::RunStatus::truncated;
  }
  running_.pop_back();
  if (status != query::RunStatus::done && status != query::RunStatus::truncated) clock_.cancel_jump();
}

bool EngineSimulation::may_run_write_helper() {
  const bool one_is_staged = std::ranges::any_of(
      running_, [](const auto& run) { return !run.front()->now.declared.writes.empty(); });
  const auto pending = std::ranges::count_if(clients_, [](const auto& c) { return c->pending(); }) - held();
  const bool idle = running_.empty() && pending == 0;
  // A full queue may cancel the probe, whose outcome then does not follow those of the others.
  constexpr std::uint32_t submitted = 3;
  const bool may_be_shed = pending + submitted >= queue_capacity;
  if (one_is_staged || idle || may_be_shed || probe_->pending() || !chance_.one_in(3)) return false;
  // Before the write helper begins, so that its order does not depend on the thread's timing.
  submit_some(submitted);
  submit_probe();
  return true;
}

void EngineSimulation::run_write_helper() {
  if (engine_->wait(*probe_->transaction).done()) ++counts_.commits_by_write_helper;
}

void EngineSimulation::submit_probe() {
  Client& probe = *probe_;
  collect(probe);
  probe.now = {};
  probe.transaction->begin({});
  probe.now.declared.writes = {{ModelWrite::Kind::create, {}, 0}};
  if (!known_.empty())
    probe.now.declared.writes = {{ModelWrite::Kind::update, random_entity(), next_mask_++}};
  const ModelWrite& write = probe.now.declared.writes.front();
  EntityRow row;
  row.mask = write.mask;
  if (write.kind == ModelWrite::Kind::create)
    probe.transaction->create(row);
  else
    probe.transaction->update(write.id, row);
  // In group mode the outcome of a commit waits for the log, which does not work here. A conflict does not
  // wait.
  if (storage_.mode() == DurabilityMode::group) {
    probe.now.declared.expected.push_back({{max_entities, 1}, 0});
    probe.transaction->expect_written_by({max_entities, 1}, 0);
  }
  submit(probe);
}

// ---- transactions of clients

EntityId EngineSimulation::random_entity() {
  return known_[chance_.below(static_cast<std::uint32_t>(known_.size()))];
}

EngineSimulation::Client* EngineSimulation::idle_client() {
  for (const auto& client : clients_) {
    const auto runs = [&](const auto& run) { return std::ranges::find(run, client.get()) != run.end(); };
    if (client.get() != probe_ && !client->pending() && std::ranges::none_of(running_, runs))
      return client.get();
  }
  return nullptr;
}

void EngineSimulation::submit_some(std::uint32_t max_count) {
  for (std::uint32_t k = chance_.below(max_count + 1); k > 0; --k) {
    Client* const client = idle_client();
    if (client == nullptr) return;
    collect(*client);
    client->now = {};
    declare(*client);
    submit(*client);
  }
}

void EngineSimulation::submit(Client& client) {
  ++counts_.steps;
  client.now.declared.newest_before = engine_->latest().version;
  client.now.declared.submitted = clock_.now();
  client.uncollected = true;
  engine_->submit(*client.transaction);
  ++submissions_;
}

Terms EngineSimulation::random_terms() {
  Terms terms;
  terms.deadline_class = static_cast<DeadlineClass>(chance_.below(4));
  terms.importance = static_cast<std::uint8_t>(chance_.below(3));
  if (terms.deadline_class != DeadlineClass::best_effort)
    terms.deadline = clock_.now() + Nanoseconds(chance_.below(6'000'000)) - Nanoseconds(50'000);
  return terms;
}

void EngineSimulation::declare(Client& client) {
  Transaction& transaction = *client.transaction;
  DeclaredTransaction& declared = client.now.declared;
  declared.terms = random_terms();
  const bool writes = chance_.one_in(2);
  if (!writes && !committed_.empty() && chance_.one_in(4)) {
    const auto back = chance_.below(static_cast<std::uint32_t>(committed_.size()));
    declared.terms.read_at = ReadAt::pinned(committed_[back]);
  }
  transaction.begin(declared.terms);
  if (writes) declare_writes(client);
  for (std::uint32_t k = known_.empty() ? 0 : chance_.below(3); k > 0; --k) {
    declared.reads.push_back(random_entity());
    transaction.read(declared.reads.back());
  }
  if (!known_.empty() && chance_.one_in(4)) {
    const EntityId id = random_entity();
    const ModelRows& rows = model_.rows(model_.newest());
    declared.expected.push_back({id, rows.at(id.index).written_by});
    transaction.expect_written_by(id, declared.expected.back().written_by);
  }
  if (!writes || chance_.one_in(2)) {
    declared.elements = 1 + chance_.below(chance_.one_in(4) ? max_elements : 2'000);
    transaction.add_query(client.query, declared.elements);
  }
}

/// Writes each entity at most once.
void EngineSimulation::declare_writes(Client& client) {
  Transaction& transaction = *client.transaction;
  std::vector<ModelWrite>& writes = client.now.declared.writes;
  std::vector<EntityId> known = known_;
  for (std::uint32_t k = 1 + chance_.below(4); k > 0; --k) {
    EntityRow row;
    row.mask = next_mask_++;
    const std::uint32_t what = chance_.below(12);
    if (known.empty() || (what < 2 && known.size() < max_entities)) {
      transaction.create(row);
      writes.push_back({ModelWrite::Kind::create, {}, row.mask});
      continue;
    }
    const auto at = known.begin() + chance_.below(static_cast<std::uint32_t>(known.size()));
    const EntityId id = *at;
    known.erase(at);
    if (what == 2) {
      transaction.remove(id);
      writes.push_back({ModelWrite::Kind::remove, id, 0});
    } else {
      transaction.update(id, row);
      writes.push_back({ModelWrite::Kind::update, id, row.mask});
    }
  }
}

void EngineSimulation::cancel_one() {
  Client& client = *clients_[chance_.below(clients)];
  if (!client.pending()) return;
  ++counts_.steps;
  client.now.declared.cancelled = true;
  engine_->cancel(*client.transaction);
}

void EngineSimulation::collect(Client& client) {
  if (!std::exchange(client.uncollected, false)) return;
  EndedTransaction& ended = client.now;
  ended.outcome = client.transaction->outcome();
  ended.outcome.status = client.transaction->status();
  if (ended.outcome.done() || ended.outcome.in_doubt) {
    const auto& set = static_cast<const transaction::TransactionImpl&>(*client.transaction).write_set();
    for (std::size_t k = 0; k < ended.declared.writes.size(); ++k)
      ended.declared.writes[k].id = set.writes[k].state.id;
  }
  for (std::uint32_t k = 0; k < ended.declared.reads.size(); ++k) {
    const EntityState* state = client.transaction->state(k);
    ended.reads.push_back(state != nullptr ? std::optional(*state) : std::nullopt);
  }
  ended_.push_back(std::move(ended));
}

}  // namespace hil::long_test
