// Records of motions omit unchanged words. After closes, kills and power losses the recovered world and every
// version in the log equal the snapshots that were taken after the commits, bit for bit.

#include <cmath>

#include "logged_engine.hpp"
#include "rtstdb/log/log_replay.hpp"
#include "tests/support/simulation/same_state.hpp"

namespace rtstdb::transaction::test {
namespace {

using Rows = std::vector<EntityState>;  // by ascending index

bool same(const Rows& a, const Rows& b) {
  return std::ranges::equal(a, b, hil::tests::same_state);
}

Rows rows_of(const log::World& world) {
  Rows rows;
  for (const EntityState& state : world.rows)
    if (state.id.valid()) rows.push_back(state);
  return rows;
}

/// Compares the replay of a log with the snapshots.
class ReplayChecker final : public log::ReplayListener {
 public:
  explicit ReplayChecker(const std::map<Version, Rows>& images) : images_(images) {}
  void world(const log::World& world) override { expect_known(world); }
  void geometry(const log::WorldGeometry&) override {}
  void material(const log::LoggedMaterial&) override {}
  void light(const log::LoggedLight&) override {}
  void commit(const store::WriteSet& set, const log::World& now, std::uint64_t) override {
    ++commits;
    for (const store::Write& write : set.writes)
      if (write.kind == store::WriteKind::update_motion) ++motions;
    expect_known(now);
  }
  void gap(const log::Gap& gap) override { ADD_FAILURE() << "a gap from " << gap.first; }
  void unresolved(const log::Gap&, std::uint64_t) override {}

  int commits = 0, motions = 0;

 private:
  void expect_known(const log::World& world) {
    const auto image = images_.find(world.latest.version);
    ASSERT_NE(image, images_.end()) << "version " << world.latest.version << " was never committed";
    EXPECT_TRUE(same(rows_of(world), image->second)) << "version " << world.latest.version;
  }
  const std::map<Version, Rows>& images_;
};

class Motions : public testing::TestWithParam<DurabilityMode> {
 protected:
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(random_() % limit); }
  Motion changed(Motion motion) {
    if (below(2) == 0) motion.p_world_m.x += 0.5;
    if (below(3) == 0) motion.p_world_m.y = -motion.p_world_m.y;  // changes the sign of zero
    if (below(3) == 0) motion.v_world_mps.z = 5e-324;
    if (below(3) == 0) motion.w_world_radps.x = below(2) == 0 ? -0.0 : 0.0;
    const double angle = below(70) * 0.1;
    if (below(3) == 0) motion.q_world = {std::cos(angle), 0.0, -0.0, std::sin(angle)};
    if (below(3) == 0) motion.valid_from = world_time_ns(below(5));
    return motion;
  }
  /// Declares up to eight writes, often to an entity that was written before. Returns whether there are any.
  bool declare(Transaction& transaction, Rows rows) {
    bool any = false;
    std::size_t free = Model::capacity - rows.size();
    for (std::uint32_t writes = 1 + below(8); writes > 0; --writes) {
      const std::uint32_t kind = below(10);
      if (rows.empty() || kind < 2) {
        if (free == 0) continue;
        --free;
        any = true;
        EntityRow row = body(below(1u << 30));
        row.motion = changed({});
        transaction.create(row);
        continue;
      }
      EntityState& state = rows[below(2) == 0 ? 0 : below(static_cast<std::uint32_t>(rows.size()))];
      state.row.motion = changed(state.row.motion);
      if (kind < 7) transaction.update_motion(state.id, state.row.motion);
      if (kind >= 7 && kind < 9) transaction.update(state.id, state.row);
      if (kind == 9) {
        transaction.remove(state.id);
        rows.erase(rows.begin() + (&state - rows.data()));
      }
      any = true;
    }
    return any;
  }
  void commit_some(LoggedEngine& db) {
    const auto transaction = db.engine.make_transaction(options_for(8, 0, 0));
    for (int k = 0; k < 40; ++k) {
      transaction->begin({});
      if (!declare(*transaction, images_.rbegin()->second)) continue;
      const Outcome& outcome = db.execute(*transaction);
      ASSERT_EQ(outcome.status, Status::committed) << describe(outcome);
      images_[outcome.version] = db.engine.snapshot(ReadAt::latest()).value();
    }
  }
  void end(LoggedEngine& db) {
    const std::uint32_t ending = below(3);
    if (ending == 1) disk_.kill();
    if (ending == 2) disk_.crash();
    db.engine.close();
  }

  std::mt19937_64 random_{7};
  SimulatedDisk disk_{7};
  std::map<Version, Rows> images_{{0, {}}};
};

INSTANTIATE_TEST_SUITE_P(Durability, Motions, every_mode(), mode_name);

TEST_P(Motions, AreRecoveredExactly) {
  int commits = 0;
  int motions = 0;
  for (int round = 0; round < 40 / one_in && !HasFailure(); ++round) {
    SCOPED_TRACE("db " + std::to_string(round));
    LoggedEngineOptions options;
    options.mode = GetParam();
    options.flush_interval = Nanoseconds(100'000);
    options.checkpoint_every_bytes = 2048u << below(4);
    LoggedEngine db(disk_, options);
    const Version found = db.log().recovery().version;
    ASSERT_TRUE(images_.contains(found)) << db.log().recovery().summary;
    EXPECT_TRUE(same(db.engine.snapshot(ReadAt::latest()).value(), images_.at(found)));
    images_.erase(images_.upper_bound(found), images_.end());
    ReplayChecker checker(images_);
    const auto read = log::replay_log(disk_, false, checker);
    ASSERT_TRUE(read.ok()) << read.error().message;
    commits += checker.commits;
    motions += checker.motions;
    commit_some(db);
    end(db);
  }
  EXPECT_GT(commits, 1000 / one_in / one_in);
  EXPECT_GT(motions, commits / 2);
}

}  // namespace
}  // namespace rtstdb::transaction::test
