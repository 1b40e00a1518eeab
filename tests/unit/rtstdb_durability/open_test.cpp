// Opening a log: refusals, recovery of geometry and shapes, salvage, failures of the disk.

#include <cerrno>

#include "logged_engine.hpp"
#include "rtstdb/log/directory.hpp"
#include "tests/support/eventually.hpp"

namespace rtstdb::transaction::test {
namespace {

class OpenLog : public testing::Test {
 protected:
  void commit_some(int count, const LoggedEngineOptions& options = {}) {
    LoggedEngine db(disk_, options);
    for (int k = 0; k < count; ++k)
      ASSERT_TRUE(db.commit(model_, random_).done());
    ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
  }
  SimulatedDisk disk_{9};
  std::mt19937_64 random_{9};
  Model model_;
};

TEST_F(OpenLog, RefusesALogThatIsOpen) {
  LoggedEngine db(disk_, {});
  const auto second = open_log(disk_, log_options({}));
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().code, ErrorCode::file);
  EXPECT_EQ(second.error().message, "another database has this log open");
}

TEST_F(OpenLog, RefusesMoreEntitiesThanItsOptionsAllow) {
  commit_some(30);
  CommitLogOptions options = log_options({});
  options.max_entities = 1;
  const auto opened = open_log(disk_, options);
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().code, ErrorCode::capacity);
  EXPECT_NE(opened.error().message.find("the options of the database allow 1"), std::string::npos)
      << opened.error().message;
}

TEST_F(OpenLog, RefusesDamageAndSalvages) {
  commit_some(60);
  auto contents = disk_.contents();
  std::erase_if(contents, [](const auto& file) { return file.first.starts_with("checkpoint."); });
  auto& segment = contents.at(log::segment_name(1));
  segment[1024 + 100] ^= std::byte{1};
  disk_.set_contents(contents);
  const auto refused = open_log(disk_, log_options({}));
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().message.find("segment.0000000001"), std::string::npos) << refused.error().message;
  CommitLogOptions options = log_options({});
  options.durability.salvage = true;
  auto salvaged = open_log(disk_, options);
  ASSERT_TRUE(salvaged.ok()) << salvaged.error().message;
  EXPECT_TRUE(salvaged.value()->recovery().salvaged);
  const Version version = salvaged.value()->recovery().version;
  ASSERT_TRUE(model_.knows(version));
  model_.continue_at(version);
  LoggedEngine db(std::move(salvaged).value(), {});
  EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
  ASSERT_TRUE(db.commit(model_, random_).done());
  EXPECT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
}

/// Each segment in turn is copied over the one before. Salvage recovers what is left, and the log then opens
/// without salvage.
TEST_F(OpenLog, SalvagesOverwrittenSegments) {
  LoggedEngineOptions small;
  small.segment_bytes = 8192;
  small.checkpoint_every_bytes = 0;
  {
    LoggedEngine db(disk_, small);
    for (int k = 1; k <= 240; ++k) {
      ASSERT_TRUE(db.commit(model_, random_).done());
      // Without gaps, since nothing after a gap would be read.
      if (k % 40 == 0) {
        ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
      }
    }
  }
  const auto undamaged = disk_.contents();
  std::vector<std::string> names;
  for (const auto& [name, bytes] : undamaged)
    if (name.starts_with("segment.")) names.push_back(name);
  ASSERT_GT(names.size(), 3u);
  const Model model = model_;
  for (std::size_t k = 0; k + 1 < names.size(); ++k) {
    SCOPED_TRACE(names[k]);
    auto contents = undamaged;
    contents[names[k]] = undamaged.at(names[k + 1]);
    disk_.set_contents(contents);
    EXPECT_FALSE(open_log(disk_, log_options(small)).ok());
    CommitLogOptions options = log_options(small);
    options.durability.salvage = true;
    auto salvaged = open_log(disk_, options);
    ASSERT_TRUE(salvaged.ok()) << salvaged.error().message;
    const Version version = salvaged.value()->recovery().version;
    model_ = model;
    model_.continue_at(version);
    {
      LoggedEngine db(std::move(salvaged).value(), small);
      EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
      for (int more = 0; more < 5; ++more)
        ASSERT_TRUE(db.commit(model_, random_).done());
      ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
    }
    auto again = open_log(disk_, log_options(small));
    ASSERT_TRUE(again.ok()) << again.error().message;
    LoggedEngine db(std::move(again).value(), small);
    EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
  }
}

/// Recovery uses an older checkpoint while the newest one is unreadable, and the newest one afterwards.
TEST_F(OpenLog, ToleratesATemporarilyUnreadableCheckpoint) {
  for (int round = 0; round < 20; ++round) {
    {
      LoggedEngine db(disk_, {.checkpoint_every_bytes = 1});
      for (int k = 0; k < 8; ++k)
        ASSERT_TRUE(db.commit(model_, random_).done());
      ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
      ASSERT_TRUE(hil::tests::eventually([&] { return db.log().state().checkpoints > 0; }, event_limit));
      disk_.fail_kind(DiskCall::write, EIO);  // so that close() writes nothing
    }
    disk_.fail_kind(DiskCall::write, 0);
    auto contents = disk_.contents();
    std::map<std::string, std::vector<std::byte>> checkpoints;
    for (auto& [name, bytes] : contents) {
      if (!name.starts_with("checkpoint.")) continue;
      checkpoints[name] = bytes;
      bytes[70] ^= std::byte{1};
    }
    disk_.set_contents(contents);
    const Version version = model_.newest_up_to(~Version{0});
    {
      LoggedEngine db(disk_, {.checkpoint_every_bytes = 0});
      EXPECT_EQ(db.engine.latest().version, version) << db.log().recovery().summary;
      for (int k = 0; k < round % 3; ++k)
        ASSERT_TRUE(db.commit(model_, random_).done());
      ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
      if (round % 2 == 0) disk_.fail_kind(DiskCall::write, EIO);
    }
    disk_.fail_kind(DiskCall::write, 0);
    contents = disk_.contents();
    // As after a power loss before its replacement was written.
    std::erase_if(contents, [](const auto& file) { return file.first.starts_with("checkpoint."); });
    for (const auto& [name, bytes] : checkpoints)
      contents[name] = bytes;
    disk_.set_contents(contents);
    auto log = open_log(disk_, log_options({}));
    ASSERT_TRUE(log.ok()) << "round " << round << ": " << log.error().message;
    LoggedEngine db(std::move(log).value(), {});
    EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())))
        << db.log().recovery().summary;
  }
}

/// With the damaged checkpoint, a later gap could not be recovered.
TEST_F(OpenLog, ReplacesADamagedCheckpoint) {
  {
    LoggedEngine db(disk_, {.checkpoint_every_bytes = 1});
    for (int k = 0; k < 8; ++k)
      ASSERT_TRUE(db.commit(model_, random_).done());
    ASSERT_TRUE(db.log().wait_until_durable(db.engine.latest().version, event_limit));
    ASSERT_TRUE(hil::tests::eventually([&] { return db.log().state().checkpoints > 0; }, event_limit));
  }
  auto contents = disk_.contents();
  for (auto& [name, bytes] : contents)
    if (name.starts_with("checkpoint.")) bytes[70] ^= std::byte{1};
  disk_.set_contents(contents);
  {
    LoggedEngine db(disk_, {.checkpoint_every_bytes = 0});
    EXPECT_TRUE(db.log().recovery().summary.starts_with("checkpoint.")) << db.log().recovery().summary;
    ASSERT_TRUE(hil::tests::eventually([&] { return db.log().state().checkpoints > 0; }, event_limit));
  }
  LoggedEngine db(disk_, {.checkpoint_every_bytes = 0});
  EXPECT_TRUE(db.log().recovery().summary.starts_with("from checkpoint.")) << db.log().recovery().summary;
  EXPECT_EQ(describe(db.image()), describe(without_generations(model_.now())));
  EXPECT_EQ(db.log().state().checkpoints, 0u);
}

TEST_F(OpenLog, ReportsEveryDiskFailure) {
  commit_some(20);
  const auto contents = disk_.contents();
  std::size_t refused = 0;
  for (std::uint64_t call = 0;; ++call) {
    SimulatedDisk disk(call + 1);
    disk.set_contents(contents);
    disk.fail_call(call, EIO);
    std::vector<DiskCall> calls;
    disk.before_each([&](DiskCall kind) { calls.push_back(kind); });
    const auto opened = open_log(disk, log_options({}));
    if (disk.calls() <= call) break;
    if (calls.at(call) == DiskCall::remove) {  // of an unfinished file, which the log ignores
      EXPECT_TRUE(opened.ok()) << opened.error().message;
      continue;
    }
    ASSERT_FALSE(opened.ok()) << "call " << call;
    EXPECT_EQ(opened.error().code, ErrorCode::file);
    EXPECT_NE(opened.error().message.find("Input/output error"), std::string::npos) << opened.error().message;
    ++refused;
  }
  EXPECT_GT(refused, 0U);
}

TEST_F(OpenLog, RecoversShapes) {
  const TriangleMesh mesh = make_box({1.0, 1.0, 1.0});
  GeometryOptions deforms;
  deforms.deforms = true;
  const auto positions = [&](float x) {
    return std::vector<glm::vec3>(mesh.positions_m.size(), glm::vec3(x));
  };
  const std::size_t count = mesh.positions_m.size();
  for (int round = 0; round < 3; ++round) {
    LoggedEngine db(disk_, {.checkpoint_every_bytes = round == 1 ? 1u : 0u});
    if (round == 0) {
      auto geometry = db.log().write_geometry(mesh, "soft", deforms);
      ASSERT_TRUE(geometry.ok());
      db.engine.call([&] {
        geometry.value().id = {0};
        db.engine.keep_shapes({0}, store::ShapeHistory::make(mesh.positions_m, deforms.retained_shapes));
        db.log().record_geometry(geometry.value(), count);
      });
    } else {
      EXPECT_EQ(db.engine.shape({0}, count, ReadAt::latest()).value()[0].x, static_cast<float>(round));
    }
    const auto transaction = db.engine.make_transaction(
        {.max_geometry_updates = 1, .max_positions = static_cast<std::uint32_t>(count)});
    for (int k = 0; k < 3; ++k) {
      transaction->begin({});
      transaction->update_geometry({0}, positions(static_cast<float>(round + 1)));
      ASSERT_TRUE(db.execute(*transaction).done()) << describe(transaction->outcome());
      ASSERT_TRUE(db.log().wait_until_durable(transaction->outcome().version, event_limit));
    }
  }
}

}  // namespace
}  // namespace rtstdb::transaction::test
