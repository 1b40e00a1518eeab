#include "followed_world.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace rtstdb::standing::test {

FollowedWorld::FollowedWorld(const FollowerOptions& options, std::uint32_t kept_changes)
    : engine_({.store = {.max_entities = options.max_entities,
                         .retained_changes = kept_changes,
                         .geometry_known =
                             [this](GeometryId id) { return !id.valid() || id.index < meshes_.size(); },
                         .max_geometries = options.max_geometries},
               .queue_capacity = 64},
              device_, clock_),
      follower_(std::make_unique<Follower>(engine_, options)),
      transaction_(
          engine_.make_transaction({.max_writes = 1024, .max_geometry_updates = 4, .max_positions = 4096})) {
  written_by_pass_ = create(EntityRow{}, -max_world_time_ns);
}

GeometryId FollowedWorld::add(const TriangleMesh& mesh, bool deforms) {
  const GeometryId id{static_cast<std::uint32_t>(meshes_.size())};
  auto used = Follower::used_positions(mesh);
  engine_.call([&] {
    meshes_.push_back(mesh);
    follower_->add_geometry(bounds_of(mesh), deforms);
    if (!deforms) return;
    engine_.keep_shapes(id, store::ShapeHistory::make(mesh.positions_m, 8));
    follower_->keep_bounds(id, std::move(used));
  });
  return id;
}

Outcome FollowedWorld::execute(const std::function<void(Transaction&)>& declare, std::int64_t ns) {
  Terms terms;
  terms.world_time = at_ns(ns);
  transaction_->begin(terms);
  declare(*transaction_);
  engine_.submit(*transaction_);
  const Outcome outcome = engine_.wait(*transaction_);
  EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
  return outcome;
}

EntityId FollowedWorld::create(const EntityRow& row, std::int64_t ns) {
  execute([&](Transaction& transaction) { transaction.create(row); }, ns);
  return transaction_->created(0);
}
void FollowedWorld::update(EntityId id, const EntityRow& row, std::int64_t ns) {
  execute([&](Transaction& transaction) { transaction.update(id, row); }, ns);
}
void FollowedWorld::update_motion(EntityId id, const Motion& motion, std::int64_t ns) {
  execute([&](Transaction& transaction) { transaction.update_motion(id, motion); }, ns);
}
void FollowedWorld::remove(EntityId id, std::int64_t ns) {
  execute([&](Transaction& transaction) { transaction.remove(id); }, ns);
}
void FollowedWorld::pass(std::int64_t ns) {
  update(written_by_pass_, EntityRow{}, ns);
}

namespace {

template <class Definition>
std::unique_ptr<StandingQuery> registered(Follower& follower, const Definition& definition,
                                          const StandingOptions& options) {
  const auto spec = make_query_spec(definition, options.name);
  EXPECT_TRUE(spec) << (spec ? "" : spec.error().message);
  auto made = follower.watch(spec.value(), options);
  EXPECT_TRUE(made) << (made ? "" : made.error().message);
  return std::move(made).value();
}

}  // namespace

std::unique_ptr<StandingQuery> FollowedWorld::watch(const StandingRegion& definition,
                                                    const StandingOptions& options) {
  return registered(*follower_, definition, options);
}
std::unique_ptr<StandingQuery> FollowedWorld::watch(const StandingRay& definition,
                                                    const StandingOptions& options) {
  return registered(*follower_, definition, options);
}
std::unique_ptr<StandingQuery> FollowedWorld::watch(const StandingNearest& definition,
                                                    const StandingOptions& options) {
  return registered(*follower_, definition, options);
}

void FollowedWorld::catch_up(const StandingQuery& query) {
  const Version latest = engine_.latest().version;
  ASSERT_TRUE(hil::tests::eventually(
      [&] { return query.status() != StandingStatus::following || query.progress().version >= latest; },
      event_limit))
      << "version " << latest;
}

oracle::World FollowedWorld::rows() {
  std::vector<const TriangleMesh*> meshes;
  for (const TriangleMesh& mesh : meshes_)
    meshes.push_back(&mesh);
  return {engine_.snapshot(ReadAt::latest()).value(), meshes, engine_.latest().time};
}

std::vector<EntityId> FollowedWorld::entities_in(const StandingRegion& definition) {
  Region region = definition.region;
  const oracle::World latest = rows();
  region.t = latest.version_time();
  return oracle::found(oracle::gaps(latest, region));
}

std::vector<StandingEvent> events_of(FollowedWorld& world, StandingQuery& query) {
  world.catch_up(query);
  std::vector<StandingEvent> all;
  std::array<StandingEvent, 64> some;
  while (const std::size_t count = query.next_events(some))
    all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(count));
  return all;
}

void Members::take(std::span<const StandingEvent> events) {
  for (const StandingEvent& event : events)
    take(event);
}

void Members::take(const StandingEvent& event) {
  const auto place = std::ranges::lower_bound(members_, event.entity.index, {}, &EntityId::index);
  switch (event.kind) {
    case EventKind::reset:
      members_.clear();
      complete_ = false;
      reported_lost_ += event.lost;
      return;
    case EventKind::complete:
      EXPECT_FALSE(complete_);
      complete_ = true;
      return;
    case EventKind::present:
    case EventKind::enter:
      EXPECT_FALSE(holds(event.entity)) << "entity " << event.entity.index << " entered twice";
      members_.insert(place, event.entity);
      return;
    case EventKind::exit:
      if (!holds(event.entity)) {
        ADD_FAILURE() << "entity " << event.entity.index << " left and was no member";
        return;
      }
      members_.erase(place);
      return;
  }
}

bool Members::holds(EntityId id) const {
  const auto place = std::ranges::lower_bound(members_, id.index, {}, &EntityId::index);
  return place != members_.end() && *place == id;
}

EntityRow row_of(GeometryId geometry, const glm::dvec3& p_world_m, const glm::dvec3& v_world_mps) {
  EntityRow row;
  row.geometry = geometry;
  row.motion.p_world_m = p_world_m;
  row.motion.v_world_mps = v_world_mps;
  return row;
}

EntityRow random_row_in_plane(std::mt19937& random, GeometryId geometry) {
  const auto number = [&] { return static_cast<double>(random() % 400) / 10.0 - 20.0; };
  return row_of(geometry, {number(), number(), 0.0}, {number(), number(), 0.0});
}

}  // namespace rtstdb::standing::test
