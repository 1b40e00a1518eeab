// Logs that were changed after they were written. Recovery returns a state that existed or refuses the log;
// if the log was closed, it returns the last state or refuses the log.

#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "rtstdb/log/bytes.hpp"
#include "rtstdb/log/checkpoint_reader.hpp"
#include "rtstdb/log/geometry_file.hpp"
#include "rtstdb/log/recovery.hpp"
#include "sample_log.hpp"
#include "tests/support/simulation/disk.hpp"

namespace rtstdb::log::test {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr std::size_t stride = 7;  // of the bits that are flipped
#else
constexpr std::size_t stride = 1;
#endif

Result<Recovered> recovered_from(const Contents& contents, const RecoveryOptions& options = {}) {
  hil::tests::SimulatedDisk disk(1, contents);
  return recover(disk, options);
}

void expect_known(const SampleLog& sample, const Recovered& recovered) {
  const auto image = sample.history.images.find(recovered.world.latest.version);
  ASSERT_NE(image, sample.history.images.end());
  ASSERT_TRUE(image->second == image_of(recovered.world)) << recovered.report.describe();
}

struct Tally {
  std::size_t refused = 0, latest = 0, earlier = 0;
};

void read_damaged(const SampleLog& sample, const Contents& contents, bool closed, Tally& tally) {
  const auto recovered = recovered_from(contents);
  if (!recovered) {
    ++tally.refused;
    ASSERT_FALSE(recovered.error().message.empty());
    return;
  }
  expect_known(sample, recovered.value());
  if (recovered.value().world.latest.version != sample.latest) {
    ASSERT_FALSE(closed) << recovered.value().report.describe();
    ++tally.earlier;
  } else {
    ASSERT_EQ(text_of(recovered.value().world), sample.latest_as_text);
    ++tally.latest;
  }
}

void flip_every_bit(const SampleLog& sample, bool closed, std::size_t step, Tally& tally) {
  Contents contents = sample.contents;
  for (auto& [name, bytes] : contents) {
    for (std::size_t bit = 0; bit < bytes.size() * 8; bit += step) {
      const auto mask = static_cast<std::byte>(1u << bit % 8);
      bytes[bit / 8] ^= mask;
      read_damaged(sample, contents, closed, tally);
      ASSERT_FALSE(testing::Test::HasFailure()) << name << " bit " << bit;
      bytes[bit / 8] ^= mask;
    }
  }
}

TEST(LogDamage, EveryFlippedBitOfAClosedLogIsRefusedOrHarmless) {
  const SampleLog sample = make_sample({.commits = 9, .segment_bytes = 2048});
  Tally tally;
  flip_every_bit(sample, true, stride, tally);
  EXPECT_GT(tally.refused, 100u / stride);
  EXPECT_GT(tally.latest, 100u / stride);
}

TEST(LogDamage, EveryFlippedBitOfAnOpenLogLeavesAnEarlierState) {
  const SampleLog sample = make_sample({.seed = 2, .commits = 9, .segment_bytes = 2048, .closed = false});
  Tally tally;
  flip_every_bit(sample, false, stride, tally);
  EXPECT_GT(tally.refused, 100u / stride);
  EXPECT_GT(tally.earlier, 10u / stride);
}

TEST(LogDamage, TruncatedLogIsAPrefixOrRefused) {
  for (const bool closed : {false, true}) {
    const SampleLog sample = make_sample({.seed = 4, .commits = 12, .segment_bytes = 5120, .closed = closed});
    Tally tally;
    for (const auto& [name, bytes] : sample.contents) {
      for (std::size_t length = 0; length < bytes.size(); length += stride == 1 ? 1 : 7) {
        Contents contents = sample.contents;
        contents[name].resize(length);
        read_damaged(sample, contents, false, tally);
        ASSERT_FALSE(HasFailure()) << name << " cut at " << length;
      }
    }
    EXPECT_GT(tally.refused, 0u) << (closed ? "closed" : "left open");
    EXPECT_EQ(tally.earlier, 0u) << "a truncated file is not an earlier state, "
                                 << (closed ? "closed" : "left open");
  }
}

/// A crash does not shorten a file: a shorter last segment is damaged, and salvage recovers a prefix. A crash
/// leaves zeros where nothing was written: such a segment is a prefix.
TEST(LogDamage, ShortenedLastSegmentIsDamagedAndOneThatEndsWithZerosIsNot) {
  const SampleLog sample = make_sample({.seed = 5, .commits = 20, .segment_bytes = 1 << 16, .closed = false});
  const std::string last = "segment.0000000001";
  ASSERT_EQ(sample.contents.count("segment.0000000002"), 0u);
  Contents shortened = sample.contents;
  std::erase_if(shortened, [](const auto& file) { return file.first.starts_with("checkpoint."); });
  Contents zeroed = shortened;
  const auto expect_prefix = [&](const Result<Recovered>& recovered, Version& newest) {
    ASSERT_TRUE(recovered.ok()) << recovered.error().message;
    expect_known(sample, recovered.value());
    ASSERT_LE(recovered.value().world.latest.version, newest);
    newest = recovered.value().world.latest.version;
  };
  Version salvaged = sample.latest, opened = sample.latest;
  const GroupPlace group = groups_of(sample.contents).back();
  const std::size_t end = group.offset + group.bytes;
  for (std::size_t length = end; length >= sector_bytes; --length) {
    SCOPED_TRACE(length);
    shortened[last].resize(length);
    const auto refused = recovered_from(shortened);
    ASSERT_FALSE(refused.ok());
    const std::string cut = "the file has " + std::to_string(length) + " bytes and was created with 65536";
    ASSERT_NE(refused.error().message.find(cut), std::string::npos) << refused.error().message;
    ASSERT_NO_FATAL_FAILURE(expect_prefix(recovered_from(shortened, {.salvage = true}), salvaged));
    std::fill(zeroed[last].begin() + static_cast<std::ptrdiff_t>(length), zeroed[last].end(), std::byte{0});
    ASSERT_NO_FATAL_FAILURE(expect_prefix(recovered_from(zeroed), opened));
    ASSERT_TRUE(length < end || (salvaged == sample.latest && opened == sample.latest));
  }
}

/// With a closing group the log is complete, whatever the length of the file.
TEST(LogDamage, ClosedLogNeedsNoBytesAfterItsEnd) {
  const SampleLog sample = make_sample({.seed = 5, .commits = 20, .segment_bytes = 1 << 16});
  Contents contents = sample.contents;
  const std::size_t end = groups_of(sample.contents).back().offset + groups_of(sample.contents).back().bytes;
  contents["segment.0000000001"].resize(end + sector_bytes);
  const auto recovered = recovered_from(contents);
  ASSERT_TRUE(recovered.ok()) << recovered.error().message;
  EXPECT_EQ(recovered.value().report.log.end, LogEnd::closed);
}

// ---- groups

class DamagedGroups : public testing::Test {
 protected:
  DamagedGroups()
      : sample(make_sample({.seed = 6, .commits = 30, .closed = false, .checkpoints = false})),
        groups(groups_of(sample.contents)) {}

  std::span<std::byte> bytes_of(Contents& contents, const GroupPlace& group) const {
    return std::span(contents[group.file]).subspan(group.offset, group.bytes);
  }
  static void expect_refused(const Contents& contents, const GroupPlace& group) {
    const auto recovered = recovered_from(contents);
    ASSERT_FALSE(recovered.ok()) << recovered.value().report.describe();
    EXPECT_EQ(recovered.error().code, ErrorCode::file);
    const std::string place = group.file + ", offset " + std::to_string(group.offset) + ", group " +
                              std::to_string(group.header.number);
    EXPECT_NE(recovered.error().message.find(place), std::string::npos) << recovered.error().message;
  }

  SampleLog sample;
  std::vector<GroupPlace> groups;
};

TEST_F(DamagedGroups, HoleIsRefusedWithItsPlaceAndVersions) {
  ASSERT_GT(groups.size(), 10u);
  for (std::size_t k = 0; k + 1 < groups.size(); ++k) {
    Contents contents = sample.contents;
    std::ranges::fill(bytes_of(contents, groups[k]), std::byte{0});
    expect_refused(contents, groups[k]);
    if (k > 0) {
      const std::string after = "after version " + std::to_string(groups[k - 1].header.last_version);
      EXPECT_NE(recovered_from(contents).error().message.find(after), std::string::npos)
          << recovered_from(contents).error().message;
    }
  }
}

TEST_F(DamagedGroups, SalvageOpensUpToTheHole) {
  for (std::size_t k = 1; k + 1 < groups.size(); ++k) {
    Contents contents = sample.contents;
    std::ranges::fill(bytes_of(contents, groups[k]), std::byte{0});
    const auto recovered = recovered_from(contents, {.salvage = true});
    ASSERT_TRUE(recovered.ok());
    expect_known(sample, recovered.value());
    EXPECT_EQ(recovered.value().world.latest.version, groups[k - 1].header.last_version);
    EXPECT_EQ(recovered.value().report.log.end, LogEnd::damaged);
    EXPECT_FALSE(recovered.value().report.log.damage.empty());
  }
}

TEST_F(DamagedGroups, ExchangedAndRepeatedGroupsAreRefused) {
  int pairs = 0;
  for (std::size_t k = 0; k + 2 < groups.size(); ++k) {
    if (groups[k].file != groups[k + 1].file || groups[k].bytes != groups[k + 1].bytes) continue;
    ++pairs;
    Contents exchanged = sample.contents;
    std::ranges::swap_ranges(bytes_of(exchanged, groups[k]), bytes_of(exchanged, groups[k + 1]));
    expect_refused(exchanged, groups[k]);
    Contents repeated = sample.contents;
    std::ranges::copy(bytes_of(repeated, groups[k]), bytes_of(repeated, groups[k + 1]).begin());
    expect_refused(repeated, groups[k + 1]);
  }
  EXPECT_GT(pairs, 0);
}

// ---- files

TEST_F(DamagedGroups, MissingSegmentIsRefused) {
  std::set<std::string> names;
  for (const GroupPlace& group : groups)
    names.insert(group.file);
  ASSERT_GT(names.size(), 2u);
  names.erase(groups.back().file);
  for (const std::string& name : names) {
    Contents contents = sample.contents;
    contents.erase(name);
    EXPECT_FALSE(recovered_from(contents).ok()) << name;
  }
  Contents none = sample.contents;
  std::erase_if(none, [](const auto& file) { return file.first.starts_with("segment."); });
  EXPECT_FALSE(recovered_from(none).ok());
}

TEST_F(DamagedGroups, SegmentOfAnotherDatabaseIsRefused) {
  const SampleLog other =
      make_sample({.seed = 6, .database_id = 99, .commits = 30, .closed = false, .checkpoints = false});
  Contents contents = sample.contents;
  const std::string name = "segment.0000000002";
  contents[name] = other.contents.at(name);
  const auto recovered = recovered_from(contents);
  ASSERT_FALSE(recovered.ok());
  EXPECT_NE(recovered.error().message.find(name + ": it belongs to database 0000000000000063"),
            std::string::npos)
      << recovered.error().message;
}

/// Segments that are exchanged, copied over another one or renamed are damage. Salvage opens the log before
/// it.
TEST_F(DamagedGroups, SegmentWithAnotherNumberIsRefused) {
  std::vector<std::string> names;
  for (const auto& [name, bytes] : sample.contents)
    if (name.starts_with("segment.")) names.push_back(name);
  ASSERT_GT(names.size(), 3u);
  const auto expect_damage = [&](const Contents& contents, std::size_t first, const std::string& what) {
    EXPECT_FALSE(recovered_from(contents).ok()) << what;
    const auto salvaged = recovered_from(contents, {.salvage = true});
    ASSERT_TRUE(salvaged.ok()) << what << ": " << salvaged.error().message;
    expect_known(sample, salvaged.value());
    EXPECT_EQ(salvaged.value().report.log.end, LogEnd::damaged);
    Version before = 0;
    for (const GroupPlace& group : groups)
      if (group.file < names[first]) before = group.header.last_version;
    EXPECT_EQ(salvaged.value().world.latest.version, before) << what;
  };
  for (std::size_t first = 0; first < names.size(); ++first) {
    for (std::size_t second = first + 1; second < names.size(); ++second) {
      Contents exchanged = sample.contents;
      std::swap(exchanged[names[first]], exchanged[names[second]]);
      expect_damage(exchanged, first, names[first] + " and " + names[second] + " exchanged");
      Contents copied = sample.contents;
      copied[names[first]] = copied[names[second]];
      expect_damage(copied, first, names[second] + " copied over " + names[first]);
      copied = sample.contents;
      copied[names[second]] = copied[names[first]];
      expect_damage(copied, second, names[first] + " copied over " + names[second]);
    }
  }
  Contents renamed = sample.contents;
  auto newest = renamed.extract(names.back());
  newest.key() = "segment.0000000099";
  renamed.insert(std::move(newest));
  const auto recovered = recovered_from(renamed);
  ASSERT_FALSE(recovered.ok());
  EXPECT_NE(recovered.error().message.find("segment.0000000099: it is a copy of " + names.back()),
            std::string::npos)
      << recovered.error().message;
  EXPECT_TRUE(recovered_from(renamed, {.salvage = true}).ok());
}

/// The header of the file with another format number and a valid checksum.
template <class Header>
void set_format(std::vector<std::byte>& file, std::uint32_t format) {
  Header header;
  std::memcpy(&header, file.data(), sizeof header);
  header.format = format;
  header.checksum = header_checksum(header, header.database_id);
  std::memcpy(file.data(), &header, sizeof header);
}

std::string other_format(std::uint32_t format) {
  return "it has log format " + std::to_string(format) +
         ", and this version of rtstdb reads format 5 only; open it with the version that wrote it";
}

TEST_F(DamagedGroups, OtherFormatsAreRefused) {
  for (const std::uint32_t format : {1u, 2u, 3u, 4u, format_version + 1}) {
    Contents contents = sample.contents;
    set_format<SegmentHeader>(contents["segment.0000000001"], format);
    for (const bool salvage : {false, true}) {
      const auto recovered = recovered_from(contents, {.salvage = salvage});
      ASSERT_FALSE(recovered.ok());
      EXPECT_EQ(recovered.error().message, "segment.0000000001: " + other_format(format));
    }
  }
}

TEST(LogDamage, CheckpointsAndGeometriesOfOtherFormatsAreRefused) {
  const SampleLog sample = make_sample({.seed = 8});
  for (const auto& [name, bytes] : sample.contents) {
    hil::tests::SimulatedDisk disk(1);
    Contents contents = sample.contents;
    if (name.starts_with("checkpoint.")) {
      set_format<CheckpointHeader>(contents[name], 2);
      disk.set_contents(contents);
      const auto header = read_checkpoint_header(disk, std::stoull(name.substr(name.find('.') + 1)));
      ASSERT_FALSE(header.ok());
      EXPECT_EQ(header.error().message, name + ", offset 0: " + other_format(2));
    } else if (name.starts_with("geometry.")) {
      GeometryHeader header;
      set_format<GeometryHeader>(contents[name], 1);
      std::memcpy(&header, contents[name].data(), sizeof header);
      disk.set_contents(contents);
      const auto mesh = read_geometry_file(disk, header.database_id, header.number, header.checksum);
      ASSERT_FALSE(mesh.ok());
      EXPECT_EQ(mesh.error().message, name + ": " + other_format(1));
    }
  }
}

TEST(LogDamage, DamagedOrMissingGeometryFileIsRefused) {
  const SampleLog sample = make_sample({.seed = 8});
  for (const auto& [name, bytes] : sample.contents) {
    if (!name.starts_with("geometry.")) continue;
    Contents contents = sample.contents;
    contents[name].back() ^= std::byte{1};
    const auto damaged = recovered_from(contents);
    ASSERT_FALSE(damaged.ok());
    EXPECT_NE(damaged.error().message.find(name), std::string::npos) << damaged.error().message;
    contents.erase(name);
    EXPECT_FALSE(recovered_from(contents).ok());
  }
}

TEST(LogDamage, DamagedCheckpointIsReplacedByAnOlderOne) {
  const SampleLog sample = make_sample({.seed = 9});
  ASSERT_EQ(sample.contents.count("checkpoint.0000000002"), 1u);
  Contents contents = sample.contents;
  contents["checkpoint.0000000002"][300] ^= std::byte{1};
  auto recovered = recovered_from(contents);
  ASSERT_TRUE(recovered.ok()) << recovered.error().message;
  EXPECT_EQ(recovered.value().report.checkpoint, 1u);
  ASSERT_EQ(recovered.value().report.damaged_checkpoints.size(), 1u);
  EXPECT_NE(recovered.value().report.describe().find("checkpoint.0000000002"), std::string::npos);
  EXPECT_EQ(text_of(recovered.value().world), sample.latest_as_text);

  contents["checkpoint.0000000001"][300] ^= std::byte{1};
  recovered = recovered_from(contents);
  ASSERT_TRUE(recovered.ok());
  EXPECT_EQ(recovered.value().report.checkpoint, 0u);
  EXPECT_EQ(text_of(recovered.value().world), sample.latest_as_text);
}

}  // namespace
}  // namespace rtstdb::log::test
