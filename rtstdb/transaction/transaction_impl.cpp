#include "rtstdb/transaction/transaction_impl.hpp"

#include <rtstdb/limits.hpp>
#include <rtstdb/result.hpp>

namespace rtstdb::transaction {

TransactionImpl::TransactionImpl(const TransactionOptions& options, const Engine& engine)
    : options_(options), engine_(engine) {
  preconditions_.reserve(options.max_preconditions);
  write_set_.writes.reserve(options.max_writes);
  creates_.reserve(options.max_writes);
  write_set_.shapes.reserve(options.max_geometry_updates);
  positions_m_.reserve(options.max_positions);
  requests_.reserve(options.max_queries);
  declared_counts_.reserve(options.max_queries);
  reads_.reserve(options.max_reads);
}

TransactionImpl::~TransactionImpl() {
  RTSTDB_REQUIRE(status() != Status::pending, "Transaction's destructor",
                 "the transaction is pending; wait for its outcome first (Database::wait)");
}

void TransactionImpl::begin(const Terms& terms) noexcept {
  RTSTDB_REQUIRE(status() != Status::pending, "Transaction::begin",
                 "the transaction is pending; wait for its outcome first (Database::wait)");
  RTSTDB_REQUIRE(terms.importance <= max_importance, "Transaction::begin",
                 "Terms::importance is above max_importance (7)");
  terms_ = terms;
  preconditions_.clear();
  write_set_.writes.clear();
  write_set_.shapes.clear();
  positions_m_.clear();
  write_set_.time = terms.world_time;
  creates_.clear();
  requests_.clear();
  declared_counts_.clear();
  reads_.clear();
  outcome_ = Outcome{};
  outcome_.deadline_class = terms.deadline_class;
  begun_ = true;
  status_.set(static_cast<std::uint32_t>(Status::idle));
}

void TransactionImpl::require_declaring(const char* call) const noexcept {
  RTSTDB_REQUIRE(status() != Status::pending, call,
                 "the transaction is pending; wait for its outcome, then call Transaction::begin");
  RTSTDB_REQUIRE(status() == Status::idle, call,
                 "the transaction has its outcome; call Transaction::begin before it is declared again");
  require_begun(call);
}

const Outcome& TransactionImpl::outcome() const noexcept {
  RTSTDB_REQUIRE(status() != Status::idle, "Transaction::outcome",
                 "the transaction was not submitted since its last begin (Database::submit)");
  return outcome_;
}

void TransactionImpl::require_begun(const char* call) const noexcept {
  RTSTDB_REQUIRE(begun_, call, "the transaction was never begun; call Transaction::begin first");
}

void TransactionImpl::require_outcome(const char* call) const noexcept {
  RTSTDB_REQUIRE(status() != Status::idle, call, "the transaction was not submitted (Database::submit)");
  RTSTDB_REQUIRE(status() != Status::pending, call,
                 "the transaction is pending; wait for its outcome first (Database::wait)");
}

void TransactionImpl::expect_exists(EntityId entity) noexcept {
  declare("Transaction::expect_exists", {entity, true, 0});
}

void TransactionImpl::expect_written_by(EntityId entity, Version version) noexcept {
  declare("Transaction::expect_written_by", {entity, false, version});
}

std::uint32_t TransactionImpl::create(const EntityRow& row) noexcept {
  declare("Transaction::create", store::WriteKind::create, EntityId{}) = row;
  creates_.push_back(static_cast<std::uint32_t>(write_set_.writes.size()) - 1);
  return static_cast<std::uint32_t>(creates_.size()) - 1;
}

void TransactionImpl::update(EntityId entity, const EntityRow& row) noexcept {
  declare("Transaction::update", store::WriteKind::update, entity) = row;
}

void TransactionImpl::update_motion(EntityId entity, const Motion& motion) noexcept {
  declare("Transaction::update_motion", store::WriteKind::update_motion, entity).motion = motion;
}

void TransactionImpl::remove(EntityId entity) noexcept {
  declare("Transaction::remove", store::WriteKind::remove, entity);
}

void TransactionImpl::update_geometry(GeometryId geometry, std::span<const glm::vec3> positions_m) noexcept {
  require_declaring("Transaction::update_geometry");
  RTSTDB_REQUIRE(write_set_.shapes.size() < options_.max_geometry_updates, "Transaction::update_geometry",
                 "more geometry updates than TransactionOptions::max_geometry_updates");
  const std::size_t first = positions_m_.size();
  const std::size_t space = options_.max_positions - first;
  store::ShapeWrite write{
      .geometry = geometry, .given = positions_m.size(), .space = space, .positions_m = {}};
  if (write.given <= space) {
    positions_m_.insert(positions_m_.end(), positions_m.begin(), positions_m.end());
    write.positions_m = std::span(positions_m_).subspan(first);
  }
  write_set_.shapes.push_back(write);
}

std::uint32_t TransactionImpl::read(EntityId entity) noexcept {
  require_declaring("Transaction::read");
  RTSTDB_REQUIRE(reads_.size() < options_.max_reads, "Transaction::read",
                 "more reads than TransactionOptions::max_reads");
  reads_.push_back({entity, {}, 0});
  return static_cast<std::uint32_t>(reads_.size()) - 1;
}

void TransactionImpl::add_query(Query& query, std::uint32_t count) noexcept {
  declare(dynamic_cast<query::PreparedQuery*>(&query), count);
}

void TransactionImpl::declare(const char* call, const Precondition& precondition) noexcept {
  require_declaring(call);
  RTSTDB_REQUIRE(preconditions_.size() < options_.max_preconditions, call,
                 "more preconditions than TransactionOptions::max_preconditions");
  preconditions_.push_back(precondition);
}

EntityRow& TransactionImpl::declare(const char* call, store::WriteKind kind, EntityId entity) noexcept {
  require_declaring(call);
  RTSTDB_REQUIRE(write_set_.writes.size() < options_.max_writes, call,
                 "more writes than TransactionOptions::max_writes");
  store::Write& write = write_set_.writes.emplace_back();
  write.kind = kind;
  write.state.id = entity;
  return write.state.row;
}

void TransactionImpl::declare(query::PreparedQuery* query, std::uint32_t count) noexcept {
  constexpr const char* call = "Transaction::add_query";
  require_declaring(call);
  RTSTDB_REQUIRE(query != nullptr, call, "the query was not made by Database::prepare");
  RTSTDB_REQUIRE(count <= query->capacity(), call, "more elements than the query's capacity");
  RTSTDB_REQUIRE(requests_.size() < options_.max_queries, call,
                 "more queries than TransactionOptions::max_queries");
  for (const query::Request& request : requests_)
    RTSTDB_REQUIRE(request.query != query, call,
                   "the query is in the transaction already; use another query");
  const std::uint32_t parts = count * query->parts_per_element();
  requests_.push_back({query, parts});
  declared_counts_.push_back(parts);
}

void TransactionImpl::scale_requests(std::uint32_t part, std::uint32_t parts) noexcept {
  for (std::size_t k = 0; k < requests_.size(); ++k)
    requests_[k].count = static_cast<std::uint32_t>(std::uint64_t{declared_counts_[k]} * part / parts);
}

EntityId TransactionImpl::created(std::uint32_t ordinal) const noexcept {
  require_outcome("Transaction::created");
  RTSTDB_REQUIRE(ordinal < creates_.size(), "Transaction::created",
                 "the ordinal is not one that Transaction::create returned since begin");
  return outcome_.done() ? write_set_.writes[creates_[ordinal]].state.id : EntityId{};
}

const EntityState* TransactionImpl::state(std::uint32_t ordinal) const noexcept {
  require_outcome("Transaction::state");
  RTSTDB_REQUIRE(ordinal < reads_.size(), "Transaction::state",
                 "the ordinal is not one that Transaction::read returned since begin");
  return outcome_.done() && reads_[ordinal].id.valid() ? &reads_[ordinal] : nullptr;
}

void TransactionImpl::answer_reads(const store::RowSource& rows) noexcept {
  for (EntityState& read : reads_) {
    const EntityState* found = rows.find(read.id);
    read = found != nullptr ? *found : EntityState{};
  }
}

void TransactionImpl::mark_pending() noexcept {
  require_declaring("Database::submit");
  outcome_.status = Status::pending;
  reserved = false;
  for (query::Request& request : requests_)
    request.answered_in_time = 0;
  cancel_requested_.store(false, std::memory_order_relaxed);
  status_.set(static_cast<std::uint32_t>(Status::pending));
}

bool TransactionImpl::request_cancel() noexcept {
  if (status() != Status::pending) return false;
  cancel_requested_.store(true, std::memory_order_release);
  return true;
}

void TransactionImpl::finish(Status status) noexcept {
  outcome_.status = status;
  status_.set_and_wake(static_cast<std::uint32_t>(status));
}

}  // namespace rtstdb::transaction
