// Ranges of a log: every version in a range is as it was committed, and missing versions are refused.

#include "rtstdb/log/version_range.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

#include "rtstdb/log/writer.hpp"
#include "sample_log.hpp"
#include "tests/support/simulation/clock.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
namespace {

using hil::tests::SimulatedDisk;

std::map<std::uint32_t, EntityState> rows_of(const store::RowSource& source) {
  std::map<std::uint32_t, EntityState> rows;
  for (std::uint32_t index = 0; index < source.index_limit(); ++index)
    if (const EntityState* state = source.row(index)) rows[index] = *state;
  return rows;
}

std::unique_ptr<store::Store> store_of(VersionRange& range) {
  auto store =
      std::make_unique<store::Store>(store::StoreOptions{.max_entities = live_entities,
                                                         .retained_changes = 4096,
                                                         .geometry_known = [](GeometryId) { return true; },
                                                         .max_geometries = 16});
  for (WorldGeometry& geometry : range.begin.geometries)
    geometry.logged.options.retained_shapes = max_retained_shapes;
  apply_range(range, *store);
  return store;
}

/// The changed shapes at a version, from the images of the history.
void expect_same(store::Store& store, Version version, const Image& image) {
  const auto read = store.read(ReadAt::pinned(version), store::ReadFor::rows_and_shapes);
  const auto* snapshot = std::get_if<store::Snapshot>(&read);
  ASSERT_NE(snapshot, nullptr) << version;
  EXPECT_EQ(snapshot->time(), image.latest.time);
  const auto rows = rows_of(*snapshot);
  ASSERT_EQ(rows.size(), image.rows.size()) << version;
  Image seen = image;
  seen.rows = rows;
  ASSERT_TRUE(seen == image) << version;
  for (const auto& [geometry, shape] : image.shapes) {
    const store::Shape held = snapshot->shape(GeometryId{geometry});
    EXPECT_EQ(held.version, shape.first);
    EXPECT_TRUE(std::ranges::equal(held.positions_m, shape.second)) << version;
  }
}

TEST(LogVersionRange, EveryVersionOfEveryRangeIsCorrect) {
  const SampleLog sample = make_sample({.seed = 21, .commits = 45});
  SimulatedDisk disk(1, sample.contents);
  const auto& valid = sample.history.valid;
  ASSERT_GT(valid.size(), 40u);
  std::size_t with_shapes = 0;
  for (auto from = valid.begin(); from != valid.end(); std::advance(from, 3)) {
    for (auto to = from; to != valid.end(); std::advance(to, 4)) {
      auto range = read_version_range(disk, ReadAt::pinned(*from), ReadAt::pinned(*to), false);
      ASSERT_TRUE(range.ok()) << range.error().message;
      ASSERT_TRUE(image_of(range.value().begin) == sample.history.images.at(*from));
      const auto behind = std::next(to);
      if (behind == valid.end()) {
        EXPECT_FALSE(range.value().ends.has_value());
      } else {
        EXPECT_EQ(range.value().ends, sample.history.images.at(*behind).latest.time);
      }
      const auto store = store_of(range.value());
      EXPECT_EQ(store->latest().version, *to);
      for (auto version = from; version != behind; ++version) {
        const Image& image = sample.history.images.at(*version);
        with_shapes += image.shapes.size();
        expect_same(*store, *version, image);
        if (HasFatalFailure()) return;
      }
      if (std::distance(to, valid.end()) <= 4) break;
    }
    if (std::distance(from, valid.end()) <= 3) break;
  }
  EXPECT_GT(with_shapes, 100u);
}

TEST(LogVersionRange, TimesSelectTheVersionsThatCoverThem) {
  const SampleLog sample = make_sample({.seed = 22, .commits = 40});
  SimulatedDisk disk(1, sample.contents);
  const WorldTime end = sample.history.images.at(sample.latest).latest.time;
  for (WorldTime from = world_time_ns(0); from <= end; from += Nanoseconds(7)) {
    const WorldTime to = std::min(from + Nanoseconds(31), end);
    auto range = read_version_range(disk, ReadAt::as_of(from), ReadAt::as_of(to), false);
    ASSERT_TRUE(range.ok()) << range.error().message;
    EXPECT_EQ(range.value().begin.latest.version, sample.history.newest_at(from));
    EXPECT_EQ(range.value().last().version, sample.history.newest_at(to));
    const auto store = store_of(range.value());
    for (WorldTime time = from; time <= to; time += Nanoseconds(1)) {
      const auto read = store->read(ReadAt::as_of(time));
      ASSERT_NE(std::get_if<store::Snapshot>(&read), nullptr);
      EXPECT_EQ(std::get_if<store::Snapshot>(&read)->version(), sample.history.newest_at(time));
    }
    if (const auto ends = range.value().ends) {
      const auto beyond = store->read(ReadAt::as_of(*ends));
      const auto* fault = std::get_if<BadInput>(&beyond);
      ASSERT_NE(fault, nullptr);
      EXPECT_EQ(fault->reason, BadInputReason::beyond_history);
    }
  }
}

TEST(LogVersionRange, MissingVersionsAreRefusedWithTheExtent) {
  const SampleLog sample = make_sample({.seed = 23, .commits = 30});
  SimulatedDisk disk(1, sample.contents);
  const auto refusal = [&](const ReadAt& from, const ReadAt& to) {
    const auto range = read_version_range(disk, from, to, false);
    return range ? std::string() : range.error().message;
  };
  const std::string has =
      "; the log has version 0, the empty world, to version " + std::to_string(sample.latest) + " of";
  const Version later = sample.latest + 3;
  const std::string missing = "version " + std::to_string(later) + " is not in the log" + has;
  EXPECT_EQ(refusal(ReadAt::pinned(later), ReadAt::latest()).substr(0, missing.size()), missing);
  EXPECT_EQ(refusal(ReadAt::pinned(1), ReadAt::pinned(later)).substr(0, missing.size()), missing);
  Version discarded = 1;
  while (sample.history.valid.count(discarded) != 0)
    ++discarded;
  ASSERT_LT(discarded, sample.latest) << "the sample discards some versions";
  EXPECT_NE(refusal(ReadAt::pinned(discarded), ReadAt::latest()).find("is not in the log"),
            std::string::npos);
  EXPECT_NE(refusal(ReadAt::pinned(sample.latest), ReadAt::pinned(1)).find("is before version"),
            std::string::npos);
  SimulatedDisk empty(1);
  EXPECT_EQ(read_version_range(empty, ReadAt::latest(), ReadAt::latest(), false).error().message,
            "there is no database");
}

/// Checks salvaged ranges of a log with one damaged file.
class SalvagedTimes {
 public:
  explicit SalvagedTimes(std::uint64_t seed) : sample_(make_sample({.seed = seed, .commits = 40})) {}

  /// Damages one byte of a file, at three places.
  void damage_each_file() {
    for (const auto& [name, bytes] : sample_.contents) {
      for (const std::size_t place : {std::size_t{100}, bytes.size() / 2, bytes.size() - 1}) {
        SCOPED_TRACE(testing::Message() << name << " at " << place);
        if (place >= bytes.size()) continue;
        Contents damaged = sample_.contents;
        damaged[name][place] ^= std::byte{0x10};
        SimulatedDisk disk(1, damaged);
        if (name.starts_with("geometry.")) expect_extent_names(disk, name);
        for (WorldTime time = world_time_ns(0); time <= end(); time += Nanoseconds(11)) {
          read(disk, time, ReadAt::latest());
          read(disk, time, ReadAt::as_of(time));
        }
      }
    }
  }
  std::size_t answered = 0, refused = 0, geometries = 0;

 private:
  WorldTime end() const { return sample_.history.images.at(sample_.latest).latest.time; }
  void read(SimulatedDisk& disk, WorldTime time, const ReadAt& to) {
    auto range = read_version_range(disk, ReadAt::as_of(time), to, true);
    if (!range.ok()) {
      ++refused;
      return;
    }
    const auto store = store_of(range.value());
    for (const WorldTime at : {time, time + Nanoseconds(5), end()}) {
      const auto read = store->read(ReadAt::as_of(at));
      const auto* snapshot = std::get_if<store::Snapshot>(&read);
      ++(snapshot != nullptr ? answered : refused);
      if (snapshot != nullptr) {
        EXPECT_EQ(snapshot->version(), sample_.history.newest_at(at));
      }
    }
  }
  void expect_extent_names(SimulatedDisk& disk, const std::string& name) {
    ++geometries;
    EXPECT_FALSE(read_extent(disk, false).ok());
    const Extent salvaged = read_extent(disk, true).value();
    EXPECT_NE(salvaged.damage.find(name), std::string::npos) << salvaged.damage;
    EXPECT_LT(salvaged.last.version, sample_.latest);
  }

  SampleLog sample_;
};

/// For any damaged file, a salvaged range answers a time correctly or refuses it.
TEST(LogVersionRange, DamagedLogRefusesTimesAfterTheDamage) {
  std::size_t answered = 0, refused = 0, geometries = 0;
  for (std::uint64_t seed = 25; seed < 50; ++seed) {
    SCOPED_TRACE(seed);
    SalvagedTimes times(seed);
    times.damage_each_file();
    if (testing::Test::HasFailure()) return;
    answered += times.answered;
    refused += times.refused;
    geometries += times.geometries;
  }
  EXPECT_GT(answered, 5'000u);
  EXPECT_GT(refused, 5'000u);
  EXPECT_GT(geometries, 20u);
}

TEST(LogVersionRange, OlderSegmentsMayBeRemoved) {
  SampleLog sample = make_sample({.seed = 24, .commits = 60});
  SimulatedDisk disk(1, sample.contents);
  const Listing listing = list_log(disk).value();
  ASSERT_GE(listing.checkpoints.size(), 2u);
  const Extent before_removal = read_extent(disk, false).value();
  EXPECT_EQ(before_removal.first.version, 0u);
  EXPECT_EQ(before_removal.last.version, sample.latest);
  EXPECT_EQ(before_removal.commits, sample.history.valid.size());
  EXPECT_EQ(before_removal.end, LogEnd::closed);

  const std::uint64_t begins_in = recover(disk).value().report.read_from.segment;
  ASSERT_GT(begins_in, listing.segments.front());
  for (const std::uint64_t segment : listing.segments)
    if (segment < begins_in) sample.contents.erase(segment_name(segment));
  disk.set_contents(sample.contents);
  sample.contents.erase(checkpoint_name(listing.checkpoints.front()));
  disk.set_contents(sample.contents);
  const Extent rest = read_extent(disk, false).value();
  EXPECT_GT(rest.first.version, 0u);
  EXPECT_EQ(rest.last.version, sample.latest);
  EXPECT_TRUE(read_version_range(disk, ReadAt::pinned(rest.first.version), ReadAt::latest(), false).ok());
  const auto before = read_version_range(disk, ReadAt::pinned(1), ReadAt::latest(), false);
  ASSERT_FALSE(before.ok());
  EXPECT_EQ(
      before.error().message.substr(0, 53 + std::to_string(rest.first.version).size()),
      "version 1 is not in the log; the log has version " + std::to_string(rest.first.version) + " of ");
}

// Their records omit the world time.
TEST(LogVersionRange, MovesAfterACheckpointHaveItsTime) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SampleLog sample = make_sample({.seed = seed, .commits = 60, .moves_at_the_end = 4});
    SimulatedDisk disk(1, sample.contents);
    const Recovered recovered = recover(disk).value();
    ASSERT_EQ(recovered.report.checkpoint_version, sample.latest - 4);
    const WorldTime time = sample.history.images.at(sample.latest - 4).latest.time;
    EXPECT_EQ(recovered.world.latest.time, time);
    for (Version from = sample.latest - 4; from <= sample.latest; ++from) {
      const auto range = read_version_range(disk, ReadAt::pinned(from), ReadAt::latest(), false);
      ASSERT_TRUE(range.ok()) << range.error().message;
      EXPECT_EQ(range.value().last().version, sample.latest);
      EXPECT_EQ(range.value().last().time, time);
    }
    remove_before(recovered, sample.contents);
    disk.set_contents(sample.contents);
    const auto extent = read_extent(disk, false);
    ASSERT_TRUE(extent.ok()) << extent.error().message;
    EXPECT_EQ(extent.value().last.version, sample.latest);
    EXPECT_EQ(extent.value().last.time, time);
  }
}

TEST(LogVersionRange, GapsAreRefused) {
  SimulatedDisk disk(1);
  hil::tests::SimulatedClock clock;
  History history;
  LiveWorld world(6, history, 2048);
  auto writer =
      Writer::start(disk, clock, world.ring(), world, {.segment_bytes = 1 << 14, .checkpoint_every_bytes = 0},
                    start_after(recover(disk).value(), 77));
  ASSERT_TRUE(writer.ok());
  for (int k = 0; k < 40; ++k)
    world.commit();
  write_all(*writer.value());
  const Version before = writer.value()->durable();
  ASSERT_LT(before, 40u);
  world.recorder().maintain();
  world.commit();
  world.commit();
  write_all(*writer.value());
  ASSERT_EQ(writer.value()->durable(), 42u);

  const Extent extent = read_extent(disk, false).value();
  ASSERT_EQ(extent.gaps.size(), 1u);
  EXPECT_EQ(extent.gaps[0].first, before + 1);
  EXPECT_EQ(extent.gaps[0].last, 40u);
  EXPECT_EQ(extent.last.version, 42u);
  const auto across = read_version_range(disk, ReadAt::pinned(before), ReadAt::latest(), false);
  ASSERT_FALSE(across.ok());
  EXPECT_NE(
      across.error().message.find("versions " + std::to_string(before + 1) + " to 40 are not in the log"),
      std::string::npos);
  EXPECT_FALSE(read_version_range(disk, ReadAt::pinned(before + 1), ReadAt::latest(), false).ok());
  auto up_to_it = read_version_range(disk, ReadAt::pinned(1), ReadAt::pinned(before), false);
  ASSERT_TRUE(up_to_it.ok()) << up_to_it.error().message;
  const WorldTime last = up_to_it.value().last().time;
  EXPECT_EQ(up_to_it.value().ends, last) << "versions of the same time may be missing";
  for (const WorldTime time : {last, history.images.at(before + 1).latest.time})
    EXPECT_FALSE(read_version_range(disk, ReadAt::as_of(time), ReadAt::as_of(time), false).ok());
}

}  // namespace
}  // namespace rtstdb::log::test
