// The inspection of a log, which reports its contents and every damage; and the replay of a log.

#include "rtstdb/log/inspection.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <utility>

#include "rtstdb/log/log_replay.hpp"
#include "rtstdb/log/writer.hpp"
#include "sample_log.hpp"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
namespace {

using hil::tests::SimulatedDisk;

LogContents contents_of(const Contents& files) {
  SimulatedDisk disk(1, files);
  auto contents = inspect(disk);
  EXPECT_TRUE(contents.ok()) << contents.error().message;
  return contents.ok() ? std::move(contents).value() : LogContents{};
}

std::string all_of(const std::vector<std::string>& sentences) {
  std::string text;
  for (const std::string& sentence : sentences)
    text += sentence + "\n";
  return text;
}

TEST(LogInspection, ReportsTheContentsOfAnUndamagedLog) {
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const bool closed = seed % 2 == 0;
    const SampleLog sample = make_sample({.seed = seed, .commits = 40, .closed = closed});
    const LogContents contents = contents_of(sample.contents);
    EXPECT_EQ(all_of(contents.damage), "");
    EXPECT_EQ(contents.database_id, SampleOptions{}.database_id);
    EXPECT_EQ(contents.extent.first.version, 0u);
    EXPECT_EQ(contents.extent.last.version, sample.latest);
    EXPECT_EQ(contents.extent.commits, sample.history.valid.size() - sample.history.valid.count(0));
    EXPECT_EQ(contents.extent.closed, closed);
    EXPECT_EQ(contents.torn, "");
    EXPECT_EQ(contents.entities, sample.history.images.at(sample.latest).rows.size());
    EXPECT_TRUE(contents.opens);
    EXPECT_EQ(contents.opens_at, sample.latest);
    const auto count_of = [&](LogFileKind kind) {
      return std::ranges::count(contents.files, kind, &LogFile::kind);
    };
    EXPECT_EQ(count_of(LogFileKind::geometry), 2);
    EXPECT_GE(count_of(LogFileKind::checkpoint), 1);
    EXPECT_EQ(contents.compared_checkpoints, static_cast<std::uint64_t>(count_of(LogFileKind::checkpoint)));
    std::uint64_t bytes = 0;
    for (const LogFile& file : contents.files)
      bytes += file.bytes;
    std::uint64_t expected = 0;
    for (const auto& [name, content] : sample.contents)
      expected += name == lock_name ? 0 : content.size();
    EXPECT_EQ(bytes, expected);
  }
}

TEST(LogInspection, NamesAbandonedCheckpoints) {
  SampleLog sample = make_sample({.seed = 2, .commits = 40});
  const auto is_checkpoint = [](const auto& file) { return file.first.starts_with("checkpoint."); };
  const auto found = std::ranges::find_if(sample.contents, is_checkpoint);
  ASSERT_NE(found, sample.contents.end());
  const std::string name = found->first + ".abandoned";
  sample.contents[name] = std::exchange(found->second, {});
  sample.contents.erase(found->first);
  const LogContents contents = contents_of(sample.contents);
  EXPECT_EQ(all_of(contents.damage), "");
  const auto file = std::ranges::find(contents.files, LogFileKind::abandoned, &LogFile::kind);
  ASSERT_NE(file, contents.files.end());
  EXPECT_EQ(file->name, name);
  EXPECT_NE(file->note, "");
}

/// Any flipped bit in used bytes. The log is closed, since a torn end is not damage.
TEST(LogInspection, FindsEveryFlippedBit) {
  std::mt19937_64 random(5);
  const SampleLog sample = make_sample({.seed = 3, .commits = 30, .closed = true});
  std::map<std::string, std::uint64_t> end_of_groups;
  for (const GroupPlace& group : groups_of(sample.contents))
    end_of_groups[group.file] = group.offset + sizeof(GroupHeader) + group.header.payload_bytes;
  std::size_t tried = 0;
  for (const auto& [name, bytes] : sample.contents) {
    if (name == lock_name || bytes.empty()) continue;
    const bool segment = name.starts_with("segment.");
    const std::uint64_t counts = segment ? std::max(end_of_groups[name], std::uint64_t{64}) : bytes.size();
    for (int k = 0; k < 60; ++k) {
      const std::uint64_t at = random() % counts;
      if (segment && at >= sizeof(SegmentHeader) && at < sector_bytes) continue;  // unused
      Contents damaged = sample.contents;
      damaged[name][at] ^= static_cast<std::byte>(1u << random() % 8);
      SimulatedDisk disk(1, damaged);
      const auto contents = inspect(disk);
      if (!contents) continue;  // refused as a whole
      const LogContents& found = contents.value();
      // The padding of a group is covered by no checksum and is unused.
      const bool nothing_lost = found.extent.last.version == sample.latest && found.damage.empty();
      // Without its closing group the log looks like one that was not closed.
      if (nothing_lost && !found.torn.empty()) {
        EXPECT_FALSE(found.extent.closed);
        continue;
      }
      if (segment && nothing_lost) {
        bool in_padding = true;
        for (const GroupPlace& group : groups_of(sample.contents))
          if (group.file == name && at >= group.offset &&
              at < group.offset + sizeof(GroupHeader) + group.header.payload_bytes)
            in_padding = false;
        EXPECT_TRUE(in_padding) << name << " at " << at;
        continue;
      }
      ++tried;
      EXPECT_FALSE(found.damage.empty()) << name << " at " << at;
    }
  }
  EXPECT_GT(tried, 200u);
}

/// A checkpoint with valid checksums and the wrong world.
TEST(LogInspection, ComparesCheckpointsWithTheCommits) {
  const SampleLog sample = make_sample({.seed = 4, .commits = 30});
  const SampleLog other = make_sample({.seed = 5, .commits = 30});
  std::size_t found = 0;
  for (const auto& [name, bytes] : other.contents) {
    if (!name.starts_with("checkpoint.") || !sample.contents.contains(name)) continue;
    Contents exchanged = sample.contents;
    exchanged[name] = bytes;
    const LogContents contents = contents_of(exchanged);
    ASSERT_FALSE(contents.damage.empty()) << name;
    found += all_of(contents.damage).find("differs from the result of the commits") != std::string::npos ||
             all_of(contents.damage).find("that no record adds") != std::string::npos;
  }
  EXPECT_GT(found, 0u);
}

/// A checkpoint may contain a geometry that was added after the commit of its version.
TEST(LogInspection, GeometryAddedAfterTheLastCommitIsNoDamage) {
  SimulatedDisk disk(1);
  hil::tests::SimulatedClock clock;
  History history;
  LiveWorld world(9, history, 1 << 16);
  WriterOptions options;
  options.checkpoint_every_bytes = 0;
  auto writer =
      Writer::start(disk, clock, world.ring(), world, options, start_after(recover(disk).value(), 99));
  ASSERT_TRUE(writer.ok());
  world.commit();
  write_all(*writer.value());
  ASSERT_TRUE(world.add_geometry(disk, 99, 1));
  writer.value()->checkpoint_soon();
  write_all(*writer.value());
  for (int k = 0; k < 5; ++k)
    world.commit();
  write_all(*writer.value());
  ASSERT_TRUE(writer.value()->close(0).ok());
  const auto contents = inspect(disk);
  ASSERT_TRUE(contents.ok());
  EXPECT_EQ(all_of(contents.value().damage), "");
  EXPECT_EQ(contents.value().compared_checkpoints, 1u);
  EXPECT_EQ(contents.value().entities, history.images.at(world.latest()).rows.size());
}

TEST(LogInspection, TornEndIsNoDamage) {
  SampleLog sample = make_sample({.seed = 6, .commits = 30, .closed = false, .checkpoints = false});
  const GroupPlace last = groups_of(sample.contents).back();
  auto& bytes = sample.contents[last.file];
  bytes[last.offset + sizeof(GroupHeader)] ^= std::byte{1};
  const LogContents contents = contents_of(sample.contents);
  EXPECT_EQ(all_of(contents.damage), "");
  EXPECT_NE(contents.torn.find(last.file), std::string::npos) << contents.torn;
  EXPECT_LT(contents.extent.last.version, sample.latest);
  EXPECT_EQ(contents.opens_at, contents.extent.last.version);
}

/// The prediction for salvage is what salvage does.
TEST(LogInspection, ReportsWhetherSalvageOpens) {
  const SampleLog sample = make_sample({.seed = 6, .commits = 30, .checkpoints = false});
  Contents exchanged = sample.contents;
  std::swap(exchanged["segment.0000000001"], exchanged["segment.0000000002"]);
  LogContents contents = contents_of(exchanged);
  EXPECT_FALSE(contents.opens);
  EXPECT_TRUE(contents.opens_by_salvage);
  EXPECT_NE(contents.refusal, "");
  const SampleLog other = make_sample({.seed = 6, .database_id = 99, .commits = 30, .checkpoints = false});
  Contents foreign = sample.contents;
  foreign["segment.0000000002"] = other.contents.at("segment.0000000002");
  contents = contents_of(foreign);
  EXPECT_FALSE(contents.opens);
  EXPECT_FALSE(contents.opens_by_salvage);
  EXPECT_NE(contents.refusal.find("it belongs to database"), std::string::npos) << contents.refusal;
}

TEST(LogInspection, MissingLogIsRefused) {
  SimulatedDisk disk(1);
  EXPECT_FALSE(inspect(disk).ok());
}

/// Records what a replay passes, and compares its worlds with the history.
class ReplayRecorder final : public ReplayListener {
 public:
  explicit ReplayRecorder(const History& history) : history_(history) {}
  void world(const World& world) override {
    compare(world);
    after_gap_ = false;
  }
  void geometry(const WorldGeometry&) override {}
  void material(const LoggedMaterial&) override {}
  void light(const LoggedLight&) override {}
  void commit(const store::WriteSet& set, const World& now, std::uint64_t) override {
    EXPECT_FALSE(after_gap_);
    EXPECT_EQ(set.version, now.latest.version);
    EXPECT_TRUE(history_.valid.contains(set.version)) << set.version << " was discarded";
    versions.push_back(set.version);
    compare(now);
  }
  void gap(const Gap& gap) override {
    gaps.push_back(gap);
    after_gap_ = true;
  }
  void unresolved(const Gap& between, std::uint64_t commits) override {
    EXPECT_TRUE(after_gap_);
    std::uint64_t valid = 0;
    for (Version version = between.first; version <= between.last; ++version)
      valid += history_.valid.contains(version) && !is_in_a_gap(version) ? 1 : 0;
    EXPECT_EQ(commits, valid) << between.first << " to " << between.last;
    unresolved_ranges.push_back(between);
  }
  bool accounts_for(Version version) const {
    const auto holds = [&](const Gap& gap) { return gap.first <= version && version <= gap.last; };
    return std::ranges::binary_search(versions, version) || is_in_a_gap(version) ||
           std::ranges::any_of(unresolved_ranges, holds);
  }
  std::vector<Version> versions;
  std::vector<Gap> gaps, unresolved_ranges;

 private:
  bool is_in_a_gap(Version version) const {
    return std::ranges::any_of(gaps,
                               [&](const Gap& gap) { return gap.first <= version && version <= gap.last; });
  }
  void compare(const World& world) {
    EXPECT_TRUE(image_of(world) == history_.images.at(world.latest.version)) << world.latest.version;
  }
  const History& history_;
  bool after_gap_ = false;
};

TEST(LogReplay, PassesEveryVersionInOrder) {
  const SampleLog sample = make_sample({.seed = 7, .commits = 60});
  SimulatedDisk disk(1, sample.contents);
  ReplayRecorder replayed(sample.history);
  const auto report = replay_log(disk, false, replayed);
  ASSERT_TRUE(report.ok()) << report.error().message;
  std::vector<Version> valid(sample.history.valid.begin(), sample.history.valid.end());
  std::erase(valid, 0u);
  EXPECT_EQ(replayed.versions, valid);
  EXPECT_TRUE(replayed.gaps.empty());
}

TEST(LogReplay, BeginsWithTheOldestCheckpointAfterPruning) {
  SampleLog sample = make_sample({.seed = 7, .commits = 60, .moves_at_the_end = 4});
  SimulatedDisk disk(1, sample.contents);
  const Recovered recovered = recover(disk).value();
  remove_before(recovered, sample.contents);
  disk.set_contents(sample.contents);
  ReplayRecorder replayed(sample.history);
  const auto report = replay_log(disk, false, replayed);
  ASSERT_TRUE(report.ok()) << report.error().message;
  const Version latest = sample.latest;
  EXPECT_EQ(replayed.versions, (std::vector<Version>{latest - 3, latest - 2, latest - 1, latest}));
}

Result<std::unique_ptr<Writer>> start_writer(SimulatedDisk& disk, hil::tests::SimulatedClock& clock,
                                             LiveWorld& world) {
  WriterOptions options;
  options.segment_bytes = 16384;
  options.checkpoint_every_bytes = 0;
  return Writer::start(disk, clock, world.ring(), world, options, start_after(recover(disk).value(), 99));
}

/// A slow checkpoint: after the first gap there are commits and further gaps before a world is known again.
TEST(LogReplay, OmitsNoVersionAfterAGap) {
  for (const std::uint64_t seed : {8u, 9u, 10u, 11u}) {
    SimulatedDisk disk(seed);
    hil::tests::SimulatedClock clock;
    History history;
    LiveWorld world(seed, history, 1 << 12);
    auto writer = start_writer(disk, clock, world);
    ASSERT_TRUE(writer.ok());
    for (int round = 0; round < 6; ++round) {
      for (int k = 0; k < 80; ++k)
        world.commit();  // more than the ring holds
      for (int k = 0; k < 30; ++k) {
        world.commit();
        writer.value()->step(0);  // one step at a time: commits continue during the checkpoint
      }
    }
    write_all(*writer.value());
    ASSERT_TRUE(writer.value()->close(0).ok());
    ReplayRecorder replayed(history);
    const auto report = replay_log(disk, false, replayed);
    ASSERT_TRUE(report.ok()) << report.error().message;
    EXPECT_GE(replayed.gaps.size(), 2u);
    for (const Version version : history.valid)
      EXPECT_TRUE(version == 0 || replayed.accounts_for(version)) << version;
    std::uint64_t unresolved = 0;
    for (const Gap& between : replayed.unresolved_ranges)
      unresolved += between.last - between.first + 1;
    EXPECT_GT(unresolved, 0u);
    const auto inspected = inspect(disk);
    ASSERT_TRUE(inspected.ok());
    EXPECT_EQ(inspected.value().extent.gaps.size(), replayed.gaps.size());
    EXPECT_EQ(inspected.value().extent.last.version, world.latest());
    EXPECT_GT(inspected.value().unresolved_commits, 0u);
    EXPECT_EQ(all_of(inspected.value().damage), "");
  }
}

}  // namespace
}  // namespace rtstdb::log::test
