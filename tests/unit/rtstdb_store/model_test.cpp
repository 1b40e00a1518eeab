// Random commits, discards and faults, compared with a model that keeps a full copy of every version.

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>
#include <map>
#include <random>
#include <set>

#include <rtstdb/limits.hpp>

#include "rows.hpp"

namespace rtstdb::store::test {
namespace {

using Rows = std::map<std::uint32_t, EntityState>;

/// A simple reference implementation of the store.
struct Model {
  struct Copy {
    WorldTime time;
    Rows rows;
  };

  std::uint32_t max_entities;
  std::uint32_t retained_changes;
  std::map<Version, Copy> published{{0, {world_time_ns(-max_world_time_ns), {}}}};
  std::map<Version, Rows> discarded{};
  std::map<std::uint32_t, std::uint32_t> generations{};
  Version next = 1;
  std::vector<Version> changes{};  ///< the version of every change so far

  Version oldest_kept() const {
    return changes.size() > retained_changes ? changes[changes.size() - retained_changes - 1] : 0;
  }

  /// Rows and generations after the set; none if a write is invalid.
  struct Applied {
    Rows rows;
    std::map<std::uint32_t, std::uint32_t> generations;
    std::set<std::uint32_t> touched;
  };
  std::optional<Applied> apply(const WriteSet& set) const {
    if (set.time < published.rbegin()->second.time) return std::nullopt;
    Applied after{published.rbegin()->second.rows, generations, {}};
    for (const Write& write : set.writes) {
      if (!apply(write, after)) return std::nullopt;
    }
    return after;
  }

  bool apply(const Write& write, Applied& after) const {
    const auto& row = write.state.row;
    std::uint32_t index = write.state.id.index;
    if (write.kind == WriteKind::create) {
      for (index = 0; after.rows.count(index) != 0;)
        ++index;
      if (index >= max_entities) return false;
    } else if (after.rows.count(index) == 0 || after.rows.at(index).id != write.state.id) {
      return false;
    }
    if (write.kind != WriteKind::remove && !(std::abs(row.motion.p_world_m.x) <= max_coordinate_m))
      return false;
    if (write.kind == WriteKind::create || write.kind == WriteKind::update) {
      if (row.geometry.index >= known_geometries) return false;
    }
    after.touched.insert(index);
    if (write.kind == WriteKind::create) after.rows[index] = {{index, ++after.generations[index]}, row, next};
    if (write.kind == WriteKind::update) after.rows[index].row = row;
    if (write.kind == WriteKind::update_motion) after.rows[index].row.motion = row.motion;
    if (write.kind == WriteKind::remove) {
      after.rows.erase(index);
    } else {
      after.rows[index].written_by = next;
    }
    return true;
  }
};

class Comparison {
 public:
  Comparison(std::uint64_t seed, std::uint32_t max_entities, std::uint32_t retained_changes)
      : model_{max_entities, retained_changes},
        store_(options(max_entities, retained_changes)),
        random_(seed) {}

  void step() {
    WriteSet set = random_set();
    const auto expected = model_.apply(set);
    const auto fault = store_.stage(set);
    ASSERT_EQ(fault.has_value(), !expected.has_value());
    if (!fault) {
      expect_rows(store_.staged_snapshot(), expected->rows);
      expect_some_older_versions();
      finish(set, *expected);
      if (testing::Test::HasFailure()) return;
    }
    expect_rows(store_.latest_snapshot(), model_.published.rbegin()->second.rows);
    ASSERT_EQ(store_.latest().version, model_.published.rbegin()->first);
    ASSERT_EQ(store_.oldest_kept(), model_.oldest_kept());
    expect_some_older_versions();
    expect_changes();
  }

  std::size_t commits() const { return model_.published.size() - 1; }

 private:
  std::uint32_t below(std::uint32_t limit) { return static_cast<std::uint32_t>(random_() % limit); }

  EntityRow random_row() {
    EntityRow row = row_at(below(1000), below(known_geometries));
    if (below(100) == 0) row.geometry.index = 77;
    if (below(100) == 0) row.motion.p_world_m.x = std::nan("");
    return row;
  }

  EntityId random_id() {
    const std::uint32_t index = below(model_.max_entities + 1);
    const auto generation = model_.generations.find(index);
    const std::uint32_t newest = generation == model_.generations.end() ? 0 : generation->second;
    // Usually the newest generation; sometimes the next, which this set may have created, or an old one.
    return {index, newest + (below(8) == 0 ? 1 : 0) - (below(40) == 0 ? 1 : 0)};
  }

  WriteSet random_set() {
    const std::int64_t latest_ns =
        std::max<std::int64_t>(model_.published.rbegin()->second.time.time_since_epoch().count(), 0);
    WriteSet set{0, world_time_ns(latest_ns + below(4) - (below(30) == 0 ? 3 : 0)), {}};
    const std::uint32_t count = below(20) == 0 ? 1 + below(40) : 1 + below(3);
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t kind = below(10);
      if (kind < 3) set.writes.push_back(create(random_row()));
      if (kind == 3 || kind == 4) set.writes.push_back(update(random_id(), random_row()));
      if (kind == 5 || kind == 6) set.writes.push_back(update_motion(random_id(), random_row().motion));
      if (kind >= 7) set.writes.push_back(remove(random_id()));
    }
    return set;
  }

  void finish(const WriteSet& set, const Model::Applied& after) {
    const bool publish = below(4) != 0;
    const bool completes = publish && below(4) != 0;
    if (publish) {
      store_.publish();
      expect_rows(store_.latest_snapshot(), after.rows);
      expect_some_older_versions();
    }
    if (completes) {
      store_.complete_commit();
      model_.published[model_.next] = {set.time, after.rows};
      model_.generations = after.generations;
      model_.changes.insert(model_.changes.end(), after.touched.size(), model_.next);
    } else {
      store_.discard();
      model_.discarded[model_.next] = after.rows;
    }
    ++model_.next;
  }

  static void expect_rows(const Snapshot& snapshot, const Rows& rows) {
    std::size_t existing = 0;
    for (std::uint32_t index = 0; index < snapshot.index_limit(); ++index) {
      const EntityState* state = snapshot.row(index);
      if (state == nullptr) continue;
      ++existing;
      const auto expected = rows.find(index);
      ASSERT_NE(expected, rows.end()) << "version " << snapshot.version() << " index " << index;
      ASSERT_TRUE(same(*state, expected->second)) << "version " << snapshot.version() << " index " << index;
    }
    ASSERT_EQ(existing, rows.size()) << "version " << snapshot.version();
  }

  void expect_some_older_versions() {
    const Version version =
        below(8) == 0 ? below(static_cast<std::uint32_t>(model_.next + 2)) : model_.oldest_kept() + below(6);
    const bool is_staged_now = version == model_.next && store_.latest().version == version;
    if (!is_staged_now) expect_pinned(version);
    const auto newest_ns = model_.published.rbegin()->second.time.time_since_epoch().count();
    if (store_.latest().version == model_.published.rbegin()->first) {
      expect_as_of(world_time_ns(std::max(newest_ns + 1 - below(12), -max_world_time_ns)));
    }
  }

  void expect_pinned(Version version) {
    const auto answer = store_.read(ReadAt::pinned(version));
    const auto copy = model_.published.find(version);
    if (version < model_.oldest_kept()) {
      ASSERT_EQ(std::get<BadInput>(answer).reason, BadInputReason::snapshot_too_old);
    } else if (copy == model_.published.end()) {
      ASSERT_EQ(std::get<BadInput>(answer).reason, BadInputReason::unknown_version);
    } else {
      expect_rows(std::get<Snapshot>(answer), copy->second.rows);
    }
  }

  void expect_as_of(WorldTime time) {
    const auto answer = store_.read(ReadAt::as_of(time));
    Version covering = 0;
    for (const auto& [version, copy] : model_.published) {
      if (copy.time <= time) covering = version;
    }
    if (covering < model_.oldest_kept()) {
      ASSERT_EQ(std::get<BadInput>(answer).reason, BadInputReason::snapshot_too_old);
    } else {
      ASSERT_EQ(std::get<Snapshot>(answer).version(), covering);
      expect_rows(std::get<Snapshot>(answer), model_.published.at(covering).rows);
    }
  }

  /// changed_between lists every difference between a kept version and any other, published or discarded.
  void expect_changes() {
    const Version latest = store_.latest().version;
    const Version kept =
        model_.published
            .lower_bound(latest - below(static_cast<std::uint32_t>(latest - model_.oldest_kept() + 1)))
            ->first;
    const Version other =
        model_.next - 1 - below(static_cast<std::uint32_t>(std::min<Version>(model_.next, 12)));
    const bool other_published = model_.published.count(other) != 0;
    std::vector<std::uint32_t> named;
    if (!std::get<Snapshot>(store_.read(ReadAt::pinned(kept))).changed_between(other, named)) {
      ASSERT_TRUE(other < model_.oldest_kept() || !other_published) << "the changes are still kept";
      return;
    }
    const std::set<std::uint32_t> unique(named.begin(), named.end());
    ASSERT_EQ(unique.size(), named.size()) << "an index named twice";
    const Rows& kept_rows = model_.published.at(kept).rows;
    const Rows& other_rows = other_published ? model_.published.at(other).rows : model_.discarded.at(other);
    for (std::uint32_t index = 0; index < model_.max_entities; ++index) {
      const auto a = kept_rows.find(index);
      const auto b = other_rows.find(index);
      const bool differs = (a == kept_rows.end()) != (b == other_rows.end()) ||
                           (a != kept_rows.end() && !same(a->second, b->second));
      ASSERT_TRUE(!differs || unique.count(index) != 0)
          << "index " << index << " differs between " << kept << " and " << other;
    }
  }

  Model model_;
  Store store_;
  std::mt19937_64 random_;
};

struct Limits {
  std::uint32_t max_entities;
  std::uint32_t retained_changes;
};

TEST(StoreModel, AgreesAfterRandomCommits) {
  for (const Limits limits : {Limits{1, 1}, Limits{3, 2}, Limits{8, 16}, Limits{24, 64}, Limits{200, 1000}}) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
      SCOPED_TRACE(testing::Message() << "max_entities " << limits.max_entities << " retained "
                                      << limits.retained_changes << " seed " << seed);
      Comparison comparison(seed, limits.max_entities, limits.retained_changes);
      for (int step = 0; step < 600; ++step) {
        comparison.step();
        ASSERT_FALSE(HasFailure()) << "at step " << step;
      }
      EXPECT_GT(comparison.commits(), 20u) << "too few commits";
    }
  }
}

}  // namespace
}  // namespace rtstdb::store::test
