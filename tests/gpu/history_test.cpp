// A history answers what the live database answered: the same versions, rows and bits, from the log alone.

#include <unistd.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <map>
#include <random>

#include <rtstdb/history.hpp>

#include "tests/gpu/database_test.hpp"

namespace rtstdb::test {
namespace {

/// Three kinds of questions, and what a database answers to them, as words that can be compared.
class Asker {
 public:
  explicit Asker(Database& database) : database_(database) {
    rays_ = database.prepare(RayQueryOptions{.name = "rays", .capacity = count}).value();
    regions_ = database.prepare(RegionQueryOptions{.name = "regions", .capacity = count}).value();
    points_ = database.prepare(NearestQueryOptions{.name = "points", .capacity = count, .k = 3}).value();
    transaction_ = database.make_transaction({.max_queries = 3});
  }

  /// Questions follow from the seed.
  std::vector<std::uint32_t> ask(const ReadAt& read_at, WorldTime t, std::uint32_t seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> place(-20.0f, 20.0f);
    const auto point = [&] { return glm::vec3(place(random), place(random), place(random)); };
    for (std::uint32_t k = 0; k < count; ++k) {
      rays_->rays()[k] = ray_from(point(), point() + glm::vec3(0.01f), t);
      regions_->regions()[k] = region_of(RegionShape::sphere, RegionTest::touching, point(), glm::vec3(8.0f));
      regions_->regions()[k].t = t;
      points_->points()[k].point_m = point();
      points_->points()[k].t = t;
    }
    transaction_->begin(terms_at({}, read_at));
    transaction_->add_query(*rays_, count);
    transaction_->add_query(*regions_, count);
    transaction_->add_query(*points_, count);
    const Outcome& outcome = database_.execute(*transaction_);
    EXPECT_EQ(outcome.status, Status::committed) << describe(outcome);
    words_.clear();
    put(static_cast<std::uint32_t>(outcome.version));
    for (const RayHit& hit : rays_->hits().first(count)) {
      hits_ += hit.status == HitStatus::hit;
      put(static_cast<std::uint32_t>(hit.status), hit.entity.index, hit.entity.generation, hit.triangle);
      put(hit.lambda, hit.u, hit.v, hit.n_world.x, hit.n_world.y, hit.n_world.z, hit.v_relative_mps.x);
    }
    for (const RegionAnswer& answer : regions_->answers().first(count)) {
      put(answer.found);
      for (const EntityId entity : answer.entities)
        put(entity.index, entity.generation);
    }
    for (const NearestAnswer& answer : points_->answers().first(count))
      for (const Neighbor& neighbor : answer.neighbors)
        put(neighbor.entity.index, neighbor.triangle, neighbor.distance_m, neighbor.p_world_m.x);
    return words_;
  }
  std::size_t hits() const { return hits_; }

 private:
  static constexpr std::uint32_t count = 48;
  template <class... Values>
  void put(Values... values) {
    const auto one = [this](auto value) {
      std::uint32_t word = 0;
      static_assert(sizeof value == sizeof word);
      std::memcpy(&word, &value, sizeof word);
      words_.push_back(word);
    };
    (one(values), ...);
  }

  Database& database_;
  std::unique_ptr<RayQuery> rays_;
  std::unique_ptr<RegionQuery> regions_;
  std::unique_ptr<NearestQuery> points_;
  std::unique_ptr<Transaction> transaction_;
  std::vector<std::uint32_t> words_;
  std::size_t hits_ = 0;
};

class HistoryOfAWorld : public DatabaseTest {
 protected:
  static constexpr int versions = 40;

  void SetUp() override {
    directory_ = std::filesystem::temp_directory_path() / ("hil-history-" + std::to_string(getpid()));
    std::filesystem::remove_all(directory_);
    DatabaseOptions options;
    options.durability.directory = directory_;
    options.durability.checkpoint_every_bytes = 20'000;
    open(options);
  }
  void TearDown() override {
    DatabaseTest::TearDown();
    std::filesystem::remove_all(directory_);
  }

  struct Then {
    WorldTime time, asked_at;
    std::vector<std::uint32_t> answers;
    std::vector<EntityState> rows;
  };

  /// A random life; what was answered at each version.
  void live() {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> place(-15.0, 15.0);
    const auto somewhere = [&] { return glm::dvec3(place(random), place(random), place(random)); };
    const TriangleMesh soft = make_sphere(3.0);
    const GeometryId shapes[] = {
        add(make_box({3.0, 4.0, 5.0})), add(make_cylinder(1.5, 6.0)),
        database().add_geometry(soft, "soft", {.deforms = true, .retained_shapes = 4}).value()};
    Asker asker(database());
    const auto transaction =
        database().make_transaction({.max_writes = 8,
                                     .max_geometry_updates = 1,
                                     .max_positions = static_cast<std::uint32_t>(soft.positions_m.size())});
    std::vector<EntityId> alive;
    for (int k = 0; k < versions; ++k) {
      const WorldTime now = at_s(0.1 * k);
      transaction->begin(terms_at(now));
      std::vector<std::uint32_t> created;
      for (int write = 0; write < 4; ++write) {
        EntityRow row = row_of(shapes[random() % 3], somewhere());
        row.motion.q_world = glm::normalize(glm::dquat(1.0, place(random), place(random), place(random)));
        row.motion.v_world_mps = somewhere();
        row.motion.w_world_radps = 0.2 * somewhere();
        row.motion.valid_from = now;
        const auto which = alive.empty() ? 0 : random() % 4;
        if (which == 0) {
          created.push_back(transaction->create(row));
        } else if (which == 1 && alive.size() > 5) {
          transaction->remove(alive.back());
          alive.pop_back();
        } else if (which == 2) {
          transaction->update(alive[random() % alive.size()], row);
        } else {
          transaction->update_motion(alive[random() % alive.size()], row.motion);
        }
      }
      if (k % 5 == 2) {
        std::vector<glm::vec3> positions_m = soft.positions_m;
        for (glm::vec3& p : positions_m)
          p *= 1.0f + 0.02f * static_cast<float>(k);
        transaction->update_geometry(shapes[2], positions_m);
      }
      ASSERT_EQ(database().execute(*transaction).status, Status::committed)
          << describe(transaction->outcome());
      for (const std::uint32_t ordinal : created)
        alive.push_back(transaction->created(ordinal));
      Then& then = then_[transaction->outcome().version];
      then.time = now;
      then.asked_at = at_s(0.1 * k + 0.05);
      then.answers = asker.ask({}, then.asked_at, static_cast<std::uint32_t>(k));
      then.rows = database().snapshot({}).value();
    }
    hits_ = asker.hits();
  }

  std::unique_ptr<Database> past(const ReadAt& from, const ReadAt& to) {
    HistoryOptions options;
    options.directory = directory_;
    options.from = from;
    options.to = to;
    options.validation = Validation::on;
    auto opened = open_history(options);
    EXPECT_TRUE(opened.ok()) << opened.error().message;
    return opened ? std::move(opened).value() : nullptr;
  }
  void expect_as_it_was(Database& history, Version first, Version last) {
    Asker asker(history);
    std::vector<Version> order;
    for (Version version = first; version <= last; ++version)
      order.push_back(version);
    std::shuffle(order.begin(), order.end(), std::mt19937(7));
    for (const Version version : order) {
      const Then& then = then_.at(version);
      const auto seed = static_cast<std::uint32_t>(version - then_.begin()->first);
      EXPECT_EQ(asker.ask(ReadAt::pinned(version), then.asked_at, seed), then.answers) << version;
      EXPECT_EQ(asker.ask(ReadAt::as_of(then.asked_at), then.asked_at, seed), then.answers) << version;
      const auto rows = history.snapshot(ReadAt::pinned(version)).value();
      ASSERT_EQ(rows.size(), then.rows.size());
      for (std::size_t k = 0; k < rows.size(); ++k) {
        EXPECT_EQ(rows[k].id, then.rows[k].id);
        EXPECT_EQ(rows[k].written_by, then.rows[k].written_by);
        EXPECT_EQ(rows[k].row.motion.p_world_m, then.rows[k].row.motion.p_world_m);
        EXPECT_EQ(rows[k].row.motion.q_world, then.rows[k].row.motion.q_world);
      }
    }
    EXPECT_EQ(history.health().validation_messages, std::vector<std::string>());
  }

  std::filesystem::path directory_;
  std::map<Version, Then> then_;
  std::size_t hits_ = 0;
};

TEST_F(HistoryOfAWorld, AnswersWhatWasAnswered) {
  ASSERT_NO_FATAL_FAILURE(live());
  EXPECT_GT(hits_, 100u);
  const Version first = then_.begin()->first, last = then_.rbegin()->first;
  ASSERT_EQ(last - first + 1, static_cast<Version>(versions));

  // While it is being written, what is on disk.
  ASSERT_TRUE(database().wait_until_durable(last, Nanoseconds(60'000'000'000)));
  expect_as_it_was(*past(ReadAt::pinned(first + 11), ReadAt::latest()), first + 11, last);

  ASSERT_TRUE(database().close().ok());
  EXPECT_EQ(past({}, {})->latest().version, last);
  expect_as_it_was(*past(ReadAt::pinned(first), ReadAt::latest()), first, last);
  expect_as_it_was(
      *past(ReadAt::as_of(then_.at(first + 7).asked_at), ReadAt::as_of(then_.at(first + 9).asked_at)),
      first + 7, first + 9);

  const HistoryExtent extent = history_extent(directory_).value();
  EXPECT_EQ(extent.first.version, 0u);
  EXPECT_EQ(extent.last.version, last);
  EXPECT_EQ(extent.last.time, then_.at(last).time);
  EXPECT_EQ(extent.commits, static_cast<std::uint64_t>(versions));
  EXPECT_TRUE(extent.closed);
  EXPECT_TRUE(extent.gaps.empty());
}

TEST_F(HistoryOfAWorld, IsNotWrittenAndDoesNotTellWhatCameAfter) {
  ASSERT_NO_FATAL_FAILURE(live());
  ASSERT_TRUE(database().close().ok());
  const Version first = then_.begin()->first;
  const auto history = past(ReadAt::pinned(first + 2), ReadAt::pinned(first + 4));
  ASSERT_NE(history, nullptr);
  EXPECT_EQ(history->latest().version, first + 4);

  const auto writer = history->make_transaction({.max_writes = 1, .max_reads = 1});
  writer->begin(terms_at(at_s(100.0)));
  writer->create(row_of(GeometryId{0}));
  EXPECT_EQ(history->execute(*writer).status, Status::refused);
  EXPECT_EQ(writer->outcome().refused_by, RefusedBy::read_only);
  EXPECT_EQ(history->latest().version, first + 4);
  writer->begin(terms_at({}));
  writer->create(row_of(GeometryId{0}));
  EXPECT_FALSE(history->calibrate(*writer).ok());
  EXPECT_FALSE(history->add_geometry(make_box({1, 1, 1}), "new").ok());

  const auto status = [&](const ReadAt& read_at) {
    writer->begin(terms_at({}, read_at));
    writer->read(EntityId{0, 1});
    history->execute(*writer);
    return writer->outcome().bad_input.reason;
  };
  EXPECT_EQ(status(ReadAt::pinned(first + 1)), BadInputReason::snapshot_too_old);
  EXPECT_EQ(status(ReadAt::as_of(then_.at(first + 4).asked_at)), BadInputReason::none);
  EXPECT_EQ(status(ReadAt::as_of(then_.at(first + 5).time)), BadInputReason::beyond_history);
  EXPECT_NE(describe(writer->outcome()).find("ends before"), std::string::npos)
      << describe(writer->outcome());
}

TEST_F(HistoryOfAWorld, RefusesWithWhatThereIs) {
  HistoryOptions options;
  options.directory = directory_ / "nothing";
  EXPECT_EQ(open_history(options).error().code, ErrorCode::file);
  EXPECT_EQ(history_extent(options.directory).error().code, ErrorCode::file);
  std::filesystem::create_directory(options.directory);
  EXPECT_NE(history_extent(options.directory).error().message.find("there is no log of a database"),
            std::string::npos);
  ASSERT_NO_FATAL_FAILURE(live());
  ASSERT_TRUE(database().close().ok());
  options.directory = directory_;
  options.from = ReadAt::pinned(then_.rbegin()->first + 1);
  const auto beyond = open_history(options);
  ASSERT_FALSE(beyond.ok());
  EXPECT_EQ(beyond.error().code, ErrorCode::bad_input);
  EXPECT_NE(beyond.error().message.find("the log has version 0, the empty world, to version"),
            std::string::npos)
      << beyond.error().message;
}

}  // namespace
}  // namespace rtstdb::test
