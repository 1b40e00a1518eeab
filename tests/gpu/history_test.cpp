// A history gives the versions, rows and answers of the live database, bit for bit, from the log alone.

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <random>

#include <rtstdb/history.hpp>

#include "tests/gpu/database_fixture.hpp"
#include "tests/gpu/kind_cases.hpp"

namespace rtstdb::test {
namespace {

/// A query of each kind on a live database or on a history.
class QueriesOfEachKind {
 public:
  explicit QueriesOfEachKind(Database& database) : database_(database) {
    for (const AnyQueryOptions& options : one_option_per_kind())
      queries_.push_back(prepare_case(database, with(options, is_expensive(options) ? few : count)));
    transaction_ = database.make_transaction({.max_queries = static_cast<std::uint32_t>(queries_.size())});
  }
  /// The version that was read and all answers. Equal rows, times and seeds give equal elements.
  std::vector<Words> answers(const ReadAt& read_at, WorldTime t, std::span<const EntityState> rows,
                             std::uint64_t seed) {
    transaction_->begin(terms_at({}, read_at));
    Random random(seed);
    for (const auto& query : queries_) {
      query->fill(random, {rows, {.radius_m = 15.0, .version_time = t}, t, 0.0});
      transaction_->add_query(query->query(), query->capacity());
    }
    const Outcome& outcome = database_.execute(*transaction_);
    EXPECT_TRUE(outcome.done()) << describe(outcome);
    std::vector<Words> all{{static_cast<std::uint32_t>(outcome.version)}};
    for (const auto& query : queries_) {
      const std::vector<Words> words = query->words();
      all.insert(all.end(), words.begin(), words.end());
    }
    for (const RayHit& hit : dynamic_cast<RayQuery&>(queries_.front()->query()).hits())
      hits_ += hit.status == HitStatus::hit ? 1 : 0;
    return all;
  }
  std::size_t hits() const { return hits_; }

 private:
  static constexpr std::uint32_t count = 48, few = 6;

  Database& database_;
  std::vector<std::unique_ptr<KindCase>> queries_;
  std::unique_ptr<Transaction> transaction_;
  std::size_t hits_ = 0;
};

class HistoryTest : public DatabaseTest {
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

  struct Recorded {
    WorldTime time, query_time;
    std::vector<Words> answers;
    std::vector<EntityState> rows;
  };

  static Light light_number(int k) { return {.intensity_cd = 1.0 + k}; }

  /// Commits random versions and records the answers at each.
  void record_versions() {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> place(-15.0, 15.0);
    const auto somewhere = [&] { return glm::dvec3(place(random), place(random), place(random)); };
    const TriangleMesh soft = make_sphere(3.0);
    const GeometryId shapes[] = {
        add(make_box({3.0, 4.0, 5.0})), add(make_cylinder(1.5, 6.0)),
        database().add_geometry(soft, "soft", {.deforms = true, .retained_shapes = 4}).value()};
    QueriesOfEachKind queries(database());
    const auto transaction =
        database().make_transaction({.max_writes = 8,
                                     .max_geometry_updates = 1,
                                     .max_positions = static_cast<std::uint32_t>(soft.positions_m.size())});
    std::vector<EntityId> alive;
    for (int k = 0; k < versions; ++k) {
      if (k % 8 == 4) lights_.push_back(database().add_light(light_number(k), "lamp").value());
      const WorldTime now = at_s(0.1 * k);
      transaction->begin(terms_at(now));
      std::vector<std::uint32_t> created;
      for (int write = 0; write < 4; ++write) {
        EntityRow row = row_of(shapes[random() % 3], somewhere());
        row.motion.q_world = glm::normalize(glm::dquat(1.0, place(random), place(random), place(random)));
        row.motion.v_world_mps = somewhere();
        row.motion.w_world_radps = 0.2 * somewhere();
        row.motion.valid_from = now;
        if (!lights_.empty() && write % 2 == 0) row.light = lights_[alive.size() % lights_.size()];
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
      Recorded& recorded = recorded_[transaction->outcome().version];
      recorded.time = now;
      recorded.query_time = at_s(0.1 * k + 0.05);
      recorded.rows = database().snapshot({}).value();
      recorded.answers =
          queries.answers({}, recorded.query_time, recorded.rows, static_cast<std::uint64_t>(k));
    }
    hits_ = queries.hits();
  }

  std::unique_ptr<Database> open_past(const ReadAt& from, const ReadAt& to) {
    HistoryOptions options;
    options.directory = directory_;
    options.from = from;
    options.to = to;
    options.validation = Validation::on;
    auto opened = open_history(options);
    EXPECT_TRUE(opened.ok()) << opened.error().message;
    return opened ? std::move(opened).value() : nullptr;
  }
  void expect_recorded_answers(Database& history, Version first, Version last) {
    QueriesOfEachKind queries(history);
    std::vector<Version> order;
    for (Version version = first; version <= last; ++version)
      order.push_back(version);
    std::shuffle(order.begin(), order.end(), std::mt19937(7));
    for (const Version version : order) {
      const Recorded& recorded = recorded_.at(version);
      const std::uint64_t seed = version - recorded_.begin()->first;
      for (const ReadAt& read_at : {ReadAt::pinned(version), ReadAt::as_of(recorded.query_time)})
        EXPECT_EQ(queries.answers(read_at, recorded.query_time, recorded.rows, seed), recorded.answers)
            << version;
      const auto rows = history.snapshot(ReadAt::pinned(version)).value();
      ASSERT_EQ(rows.size(), recorded.rows.size());
      for (std::size_t k = 0; k < rows.size(); ++k) {
        EXPECT_EQ(rows[k].id, recorded.rows[k].id);
        EXPECT_EQ(rows[k].written_by, recorded.rows[k].written_by);
        EXPECT_EQ(rows[k].row.motion.p_world_m, recorded.rows[k].row.motion.p_world_m);
        EXPECT_EQ(rows[k].row.motion.q_world, recorded.rows[k].row.motion.q_world);
        EXPECT_EQ(rows[k].row.light, recorded.rows[k].row.light);
        if (rows[k].row.light.valid()) ++rows_with_light_;
      }
    }
    EXPECT_EQ(history.health().validation_messages, std::vector<std::string>());
  }

  std::filesystem::path directory_;
  std::map<Version, Recorded> recorded_;
  std::vector<LightId> lights_;
  std::size_t rows_with_light_ = 0;  // compared with those of the live database
  std::size_t hits_ = 0;
};

TEST_F(HistoryTest, GivesTheAnswersOfTheLiveDatabase) {
  ASSERT_NO_FATAL_FAILURE(record_versions());
  EXPECT_GT(hits_, 100u);
  const Version first = recorded_.begin()->first, last = recorded_.rbegin()->first;
  ASSERT_EQ(last - first + 1, static_cast<Version>(versions));

  // While the log is being written, a history has the durable versions.
  ASSERT_TRUE(database().wait_until_durable(last, Nanoseconds(60'000'000'000)));
  expect_recorded_answers(*open_past(ReadAt::pinned(first + 11), ReadAt::latest()), first + 11, last);

  ASSERT_TRUE(database().close().ok());
  EXPECT_EQ(open_past({}, {})->latest().version, last);
  expect_recorded_answers(*open_past(ReadAt::pinned(first), ReadAt::latest()), first, last);
  expect_recorded_answers(*open_past(ReadAt::as_of(recorded_.at(first + 7).query_time),
                                     ReadAt::as_of(recorded_.at(first + 9).query_time)),
                          first + 7, first + 9);
  EXPECT_GT(rows_with_light_, 100u);

  const HistoryExtent extent = history_extent(directory_).value();
  EXPECT_EQ(extent.first.version, 0u);
  EXPECT_EQ(extent.last.version, last);
  EXPECT_EQ(extent.last.time, recorded_.at(last).time);
  EXPECT_EQ(extent.commits, static_cast<std::uint64_t>(versions));
  EXPECT_TRUE(extent.closed);
  EXPECT_TRUE(extent.gaps.empty());
}

TEST_F(HistoryTest, IsReadOnlyAndEndsAtItsLastVersion) {
  ASSERT_NO_FATAL_FAILURE(record_versions());
  ASSERT_TRUE(database().close().ok());
  const Version first = recorded_.begin()->first;
  const auto past = open_past(ReadAt::pinned(first + 2), ReadAt::pinned(first + 4));
  ASSERT_NE(past, nullptr);
  EXPECT_EQ(past->latest().version, first + 4);

  const auto writer = past->make_transaction({.max_writes = 1, .max_reads = 1});
  writer->begin(terms_at(at_s(100.0)));
  writer->create(row_of(GeometryId{0}));
  EXPECT_EQ(past->execute(*writer).status, Status::refused);
  EXPECT_EQ(writer->outcome().refused_by, RefusedBy::read_only);
  EXPECT_EQ(past->latest().version, first + 4);
  writer->begin(terms_at({}));
  writer->create(row_of(GeometryId{0}));
  EXPECT_FALSE(past->calibrate(*writer).ok());
  EXPECT_FALSE(past->add_geometry(make_box({1, 1, 1}), "new").ok());
  EXPECT_FALSE(past->add_material({}, "new").ok());
  EXPECT_EQ(past->material({1}), database().material({1}));
  EXPECT_FALSE(past->add_light({.intensity_cd = 1.0}, "new").ok());
  ASSERT_FALSE(lights_.empty());
  EXPECT_EQ(past->light(lights_.front()), light_number(4));

  const auto status = [&](const ReadAt& read_at) {
    writer->begin(terms_at({}, read_at));
    writer->read(EntityId{0, 1});
    past->execute(*writer);
    return writer->outcome().bad_input.reason;
  };
  EXPECT_EQ(status(ReadAt::pinned(first + 1)), BadInputReason::snapshot_too_old);
  EXPECT_EQ(status(ReadAt::as_of(recorded_.at(first + 4).query_time)), BadInputReason::none);
  EXPECT_EQ(status(ReadAt::as_of(recorded_.at(first + 5).time)), BadInputReason::beyond_history);
  EXPECT_NE(describe(writer->outcome()).find("ends before"), std::string::npos)
      << describe(writer->outcome());
}

TEST_F(HistoryTest, RefusesMissingVersionsWithTheVersionsOfTheLog) {
  HistoryOptions options;
  options.directory = directory_ / "nothing";
  EXPECT_EQ(open_history(options).error().code, ErrorCode::file);
  EXPECT_EQ(history_extent(options.directory).error().code, ErrorCode::file);
  std::filesystem::create_directory(options.directory);
  EXPECT_NE(history_extent(options.directory).error().message.find("there is no log of a database"),
            std::string::npos);
  ASSERT_NO_FATAL_FAILURE(record_versions());
  ASSERT_TRUE(database().close().ok());
  options.directory = directory_;
  options.from = ReadAt::pinned(recorded_.rbegin()->first + 1);
  const auto beyond = open_history(options);
  ASSERT_FALSE(beyond.ok());
  EXPECT_EQ(beyond.error().code, ErrorCode::bad_input);
  EXPECT_NE(beyond.error().message.find("the log has version 0, the empty world, to version"),
            std::string::npos)
      << beyond.error().message;
}

}  // namespace
}  // namespace rtstdb::test
