#include "tests/torture/engine_simulation.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <utility>

namespace hil::torture {

using namespace rtstdb;  // NOLINT(google-build-using-namespace): the database that is driven

namespace {

constexpr std::size_t clients = 40;
constexpr std::uint32_t queue_capacity = 12;
constexpr std::uint32_t max_entities = 48;
constexpr std::uint32_t most_elements = 40'000;

transaction::EngineOptions engine_options() {
  return {.store = {.max_entities = max_entities,
                    .retained_changes = 1u << 14,
                    .geometry_known = [](GeometryId id) { return !id.valid(); }},
          .queue_capacity = queue_capacity,
          .chunk = Nanoseconds(1'000'000)};
}

std::uint64_t digest_of(const query::RowSource& rows) {
  std::uint64_t sum = 0;
  for (std::uint32_t index = 0; index < rows.index_limit(); ++index) {
    const EntityState* state = rows.row(index);
    if (state != nullptr) sum += row_digest(state->id, state->row.material, state->written_by);
  }
  return sum;
}

}  // namespace

/// Asks for what the world looks like, chunk by chunk.
class EngineSimulation::Query final : public RayQuery, public query::PreparedQuery {
 public:
  explicit Query(Client& client_given) : client(client_given) {}
  std::span<Ray> rays() noexcept override { return {}; }
  std::span<const RayHit> hits() const noexcept override { return {}; }
  query::QueryKind kind() const noexcept override { return query::QueryKind::ray_closest; }
  std::uint32_t capacity() const noexcept override { return most_elements; }
  std::optional<BadInput> check(std::uint32_t, const query::RowSource& rows,
                                query::TimeSpan& times) const noexcept override {
    times = {rows.time(), rows.time()};
    return std::nullopt;
  }
  const AnswerInfo& answer_info() const noexcept override { return info; }
  std::uint32_t answered() const noexcept override { return 0; }
  bool truncated() const noexcept override { return is_truncated; }
  void let_stand(std::uint32_t, std::uint32_t) noexcept override {}
  void let_fall() noexcept override {}

  Client& client;
  bool is_truncated = false;
};

struct EngineSimulation::Client {
  std::unique_ptr<Transaction> transaction;
  Query query{*this};
  EndedTransaction now;
  bool under_way = false;  // and not taken yet
  bool pending() const { return transaction->status() == Status::pending; }
};

void SimulationCounts::add(const SimulationCounts& other) {
  steps += other.steps;
  for (std::size_t k = 0; k < ended.size(); ++k)
    ended[k] += other.ended[k];
  in_gaps += other.in_gaps;
  losses += other.losses;
  losses_in_gaps += other.losses_in_gaps;
  given_back_waiting += other.given_back_waiting;
  passed_by_relief += other.passed_by_relief;
  full_queues += other.full_queues;
  shared += other.shared;
  observations += other.observations;
}

EngineSimulation::EngineSimulation(std::uint64_t seed)
    : seed_(seed), chance_(seed), engine_(engine_options(), device_, clock_) {
  for (std::size_t k = 0; k <= clients; ++k) {
    auto client = std::make_unique<Client>();
    client->transaction =
        engine_.make_transaction({.max_writes = 6, .max_preconditions = 3, .max_queries = 1, .max_reads = 4});
    clients_.push_back(std::move(client));
  }
  probe_ = clients_.back().get();
}

EngineSimulation::~EngineSimulation() = default;

std::string EngineSimulation::run(std::uint64_t steps) {
  const std::uint64_t end = counts_.steps + steps;
  while (counts_.steps < end && fault_.empty()) {
    engine_.call([&] { play_round(); });
    wait_until_idle();
    if (looks_at_snapshot_) look_at_snapshot();
  }
  engine_.call([&] { judge(); });
  return fault_;
}

/// Nothing is under way, and the device will not be tried by itself. Asked on the engine's thread, which may use a
/// transaction again at any time; how often, changes nothing.
void EngineSimulation::wait_until_idle() {
  for (bool idle = false; !idle;) {
    engine_.call([&] {
      idle = !device_.will_be_tried() &&
             std::ranges::none_of(clients_, [](const auto& client) { return client->pending(); });
    });
    if (!idle) std::this_thread::sleep_for(std::chrono::microseconds(100));
  }
}

void EngineSimulation::play_round() {
  judge();
  clock_.advance(Nanoseconds(chance_.below(200'000)));
  submit_some(12);
  looks_at_snapshot_ = chance_.one_in(8);
  device_.try_again();
}

// ---- the machine's events

void EngineSimulation::run_begins(std::span<const query::Request> requests) {
  if (!running_.empty()) ++counts_.in_gaps;
  if (requests.size() > 1) ++counts_.shared;
  std::vector<Client*>& together = running_.emplace_back();
  for (const query::Request& request : requests) {
    auto& query = static_cast<Query&>(*request.query);
    query.is_truncated = false;
    together.push_back(&query.client);
  }
}

bool EngineSimulation::chunk_done(const query::RowSource& rows, const query::PreparedQuery& query,
                                  bool last) {
  ++counts_.steps;
  Client& client = static_cast<const Query&>(query).client;
  if (std::ranges::find(running_.back(), &client) == running_.back().end())
    fail("a chunk of one whose turn it is not");
  client.now.observed.push_back({rows.version(), digest_of(rows)});
  client.now.last_chunk = clock_.now();
  if (chance_.one_in(2)) submit_some(3);
  if (chance_.one_in(6)) cancel_one();
  if (chance_.one_in(300)) {
    ++counts_.losses;
    if (running_.size() > 1) ++counts_.losses_in_gaps;
    return true;
  }
  // Between the last look at the device and the moment of publishing.
  if (last && running_.size() == 1 && chance_.one_in(8))
    clock_.stand_still_before(2, Nanoseconds(chance_.below(3'000'000)));
  return false;
}

void EngineSimulation::run_ends(query::RunStatus status) {
  for (Client* const client : running_.back()) {
    client->now.run = status;
    client->query.is_truncated = status == query::RunStatus::truncated;
  }
  running_.pop_back();
  if (status != query::RunStatus::done && status != query::RunStatus::truncated) clock_.go_on();
}

bool EngineSimulation::may_pause() {
  const bool one_is_staged = std::ranges::any_of(
      running_, [](const auto& run) { return !run.front()->now.declared.writes.empty(); });
  const bool idle =
      running_.empty() && std::ranges::none_of(clients_, [](const auto& c) { return c->pending(); });
  // The probe would be shed where the queue is full, and then say nothing of the others.
  constexpr std::uint32_t submitted = 3;
  const auto pending = std::ranges::count_if(clients_, [](const auto& c) { return c->pending(); });
  const bool may_be_shed = static_cast<std::uint32_t>(pending) + submitted >= queue_capacity;
  if (one_is_staged || idle || may_be_shed || probe_->pending() || !chance_.one_in(3)) return false;
  // All of it before the relief can begin: what it does first must not depend on how soon it is there.
  submit_some(submitted);
  submit_probe();
  return true;
}

void EngineSimulation::pauses() {
  if (engine_.wait(*probe_->transaction).done()) ++counts_.passed_by_relief;
}

void EngineSimulation::submit_probe() {
  Client& probe = *probe_;
  take_ended(probe);
  probe.now = {};
  probe.transaction->begin({});
  probe.now.declared.writes = {{ModelWrite::Kind::create, {}, 0}};
  if (!known_.empty())
    probe.now.declared.writes = {{ModelWrite::Kind::update, any_known(), next_material_++}};
  const ModelWrite& write = probe.now.declared.writes.front();
  EntityRow row;
  row.material = write.material;
  if (write.kind == ModelWrite::Kind::create)
    probe.transaction->create(row);
  else
    probe.transaction->update(write.id, row);
  submit(probe);
}

// ---- what clients do

EntityId EngineSimulation::any_known() {
  return known_[chance_.below(static_cast<std::uint32_t>(known_.size()))];
}

EngineSimulation::Client* EngineSimulation::free_client() {
  for (const auto& client : clients_) {
    const auto runs = [&](const auto& run) { return std::ranges::find(run, client.get()) != run.end(); };
    if (client.get() != probe_ && !client->pending() && std::ranges::none_of(running_, runs))
      return client.get();
  }
  return nullptr;
}

void EngineSimulation::submit_some(std::uint32_t most) {
  for (std::uint32_t k = chance_.below(most + 1); k > 0; --k) {
    Client* const client = free_client();
    if (client == nullptr) return;
    take_ended(*client);
    client->now = {};
    declare(*client);
    submit(*client);
  }
}

void EngineSimulation::submit(Client& client) {
  ++counts_.steps;
  client.now.declared.newest_before = engine_.latest().version;
  client.now.declared.submitted = clock_.now();
  client.under_way = true;
  engine_.submit(*client.transaction);
}

Terms EngineSimulation::any_terms() {
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
  declared.terms = any_terms();
  const bool writes = chance_.one_in(2);
  if (!writes && !committed_.empty() && chance_.one_in(4)) {
    const auto back = chance_.below(static_cast<std::uint32_t>(committed_.size()));
    declared.terms.read_at = ReadAt::pinned(committed_[back]);
  }
  transaction.begin(declared.terms);
  if (writes) declare_writes(client);
  for (std::uint32_t k = known_.empty() ? 0 : chance_.below(3); k > 0; --k) {
    declared.reads.push_back(any_known());
    transaction.read(declared.reads.back());
  }
  if (!known_.empty() && chance_.one_in(4)) {
    const EntityId id = any_known();
    const ModelRows& rows = model_.rows(model_.newest());
    declared.expected.push_back({id, rows.at(id.index).written_by});
    transaction.expect_written_by(id, declared.expected.back().written_by);
  }
  if (!writes || chance_.one_in(2)) {
    declared.asked = 1 + chance_.below(chance_.one_in(4) ? most_elements : 2'000);
    transaction.ask(client.query, declared.asked);
  }
}

/// No entity twice.
void EngineSimulation::declare_writes(Client& client) {
  Transaction& transaction = *client.transaction;
  std::vector<ModelWrite>& writes = client.now.declared.writes;
  std::vector<EntityId> known = known_;
  for (std::uint32_t k = 1 + chance_.below(4); k > 0; --k) {
    EntityRow row;
    row.material = next_material_++;
    const std::uint32_t what = chance_.below(12);
    if (known.empty() || (what < 2 && known.size() < max_entities)) {
      transaction.create(row);
      writes.push_back({ModelWrite::Kind::create, {}, row.material});
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
      writes.push_back({ModelWrite::Kind::update, id, row.material});
    }
  }
}

void EngineSimulation::cancel_one() {
  Client& client = *clients_[chance_.below(clients)];
  if (!client.pending()) return;
  ++counts_.steps;
  client.now.declared.cancelled = true;
  engine_.cancel(*client.transaction);
}

void EngineSimulation::take_ended(Client& client) {
  if (!std::exchange(client.under_way, false)) return;
  EndedTransaction& ended = client.now;
  ended.outcome = client.transaction->outcome();
  ended.outcome.status = client.transaction->status();
  if (ended.outcome.done()) {
    std::uint32_t created = 0;
    for (ModelWrite& write : ended.declared.writes)
      if (write.kind == ModelWrite::Kind::create) write.id = client.transaction->created(created++);
  }
  for (std::uint32_t k = 0; k < ended.declared.reads.size(); ++k) {
    const EntityState* state = client.transaction->state(k);
    ended.reads.push_back(state != nullptr ? std::optional(*state) : std::nullopt);
  }
  ended_.push_back(std::move(ended));
}

}  // namespace hil::torture
