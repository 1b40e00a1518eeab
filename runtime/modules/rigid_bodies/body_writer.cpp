#include "runtime/modules/rigid_bodies/body_writer.hpp"

#include <algorithm>
#include <utility>

namespace hil::modules {

BodyWriter::BodyWriter(World& world, const TaskParameters& task, std::vector<rtstdb::EntityId> entities,
                       const BodySet& bodies, const RowError& permitted)
    : database_(world.database()),
      entities_(std::move(entities)),
      permitted_(permitted),
      written_(entities_.size()),
      begin_(entities_.size()) {
  transaction_ = database_.make_transaction({.max_writes = static_cast<std::uint32_t>(entities_.size())});
  pending_.reserve(entities_.size());
  for (std::size_t i = 0; i < entities_.size(); ++i)
    written_[i] = bodies.bodies()[i].row;
  // A transaction that writes rows takes microseconds. The budget is larger, for a loaded machine.
  const rtstdb::Nanoseconds deadline(task.deadline_ns);
  reservation_ = world.reserve({.name = task.instance,
                                .period = rtstdb::Nanoseconds(task.period_ns),
                                .deadline = deadline,
                                .budget = std::min(rtstdb::Nanoseconds{200'000}, deadline)});
}

void BodyWriter::begin_step(const BodySet& bodies) noexcept {
  for (std::size_t i = 0; i < begin_.size(); ++i)
    begin_[i] = bodies.bodies()[i].state;
}

void BodyWriter::write_step(WorldStep& context, const BodySet& bodies,
                            std::span<const char> is_near) noexcept {
  const auto permits = [&](const RowError& error) {
    return error.position_m <= permitted_.position_m && error.angle_rad <= permitted_.angle_rad;
  };
  const rtstdb::WorldTime begin = context.world_time();
  const rtstdb::WorldTime end = rtstdb::world_time_ns(context.time_ns + context.period_ns);
  const double duration_s = 1e-9 * static_cast<double>(context.period_ns);
  pending_.clear();
  for (std::size_t i = 0; i < begin_.size(); ++i) {
    const BodySet::Body& body = bodies.bodies()[i];
    if (!body.rigid_body) continue;
    const bool changes = is_near[i] != 0 && !body.is_held && !body.has_stopped;
    if (!changes && written_[i] && permits(error_of(*written_[i], begin_[i], begin)) &&
        permits(error_of(*written_[i], body.state, end)))
      continue;
    pending_.push_back({i, row_between(begin_[i], body.state, begin, duration_s)});
  }
  write_pending(context);
}

void BodyWriter::write_states(WorldStep& context, const BodySet& bodies) noexcept {
  pending_.clear();
  for (std::size_t i = 0; i < begin_.size(); ++i) {
    const BodySet::Body& body = bodies.bodies()[i];
    if (!body.rigid_body) continue;
    pending_.push_back({i,
                        {.p_world_m = body.state.p_world_m,
                         .q_world = body.state.q_world,
                         .v_world_mps = body.state.v_world_mps,
                         .w_world_radps = body.rigid_body->w_world_radps(body.state),
                         .valid_from = context.world_time()}});
  }
  write_pending(context);
}

void BodyWriter::write_pending(WorldStep& context) noexcept {
  if (pending_.empty()) return;
  transaction_->begin({.deadline_class = rtstdb::DeadlineClass::hard,
                       .deadline = context.deadline,
                       .importance = rtstdb::max_importance,
                       .world_time = context.world_time(),
                       .read_at = {},
                       .reservation = reservation_});
  for (const Pending& pending : pending_)
    transaction_->update_motion(entities_[pending.body], pending.row);
  const rtstdb::Outcome& outcome = context.execute(database_, *transaction_);
  for (const Pending& pending : pending_) {
    written_[pending.body].reset();
    if (outcome.done()) written_[pending.body] = pending.row;
  }
  if (!outcome.done()) return;
  rows_ += pending_.size();
  version_ = outcome.version;
}

}  // namespace hil::modules
