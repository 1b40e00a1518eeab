// Encoding and decoding of records, and refused records.

#include "rtstdb/log/record.hpp"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>
#include <optional>
#include <utility>

#include "random_sets.hpp"
#include "rtstdb/store/motion_words.hpp"

namespace rtstdb::log::test {
namespace {

using Bytes = std::vector<std::byte>;

Bytes bytes_of(const store::WriteSet& set, const CommitEncoding& form) {
  Bytes bytes(form.bytes);
  encode_commit(set, form, bytes);
  return bytes;
}
Bytes bytes_of(const store::WriteSet& set, std::optional<WorldTime> previous_time = {}) {
  return bytes_of(set, encoding_of(set, previous_time));
}
RecordKind kind_of(const Bytes& bytes) {
  RecordHeader header;
  std::memcpy(&header, bytes.data(), sizeof header);
  return header.kind;
}
/// The move of one entity in which one word of the motion has changed.
store::WriteSet move(Version version, WorldTime time) {
  store::WriteSet set{version, time, {{store::WriteKind::update_motion, {{1, 1}, {}, version}}}};
  set.writes[0].unchanged = store::all_motion_words & ~1u;
  set.writes[0].base_version_low = 77;
  set.writes[0].state.row.motion = store::motion_of({std::bit_cast<std::uint64_t>(2.5)});
  return set;
}
Bytes bytes_of(const LoggedGeometry& geometry) {
  Bytes bytes(geometry_bytes(geometry));
  encode_geometry(geometry, bytes);
  return bytes;
}
template <class Value>
Bytes bytes_of(const LoggedDefinition<Value>& definition) {
  Bytes bytes(definition_bytes(definition));
  encode_definition(definition, bytes);
  return bytes;
}
Bytes bytes_of(const Record& record) {
  if (record.kind == RecordKind::commit) return bytes_of(record.commit);
  if (record.kind == RecordKind::geometry) return bytes_of(record.geometry);
  if (record.kind == RecordKind::material) return bytes_of(record.material);
  if (record.kind == RecordKind::light) return bytes_of(record.light);
  Bytes bytes(record.kind == RecordKind::gap ? gap_bytes : discard_bytes);
  if (record.kind == RecordKind::gap) {
    encode_gap(record.version, record.to, bytes);
  } else {
    encode_discard(record.version, bytes);
  }
  return bytes;
}

void expect_same(const store::WriteSet& a, const store::WriteSet& b) {
  ASSERT_EQ(a.version, b.version);
  ASSERT_EQ(a.time, b.time);
  ASSERT_EQ(a.writes.size(), b.writes.size());
  ASSERT_EQ(a.shapes.size(), b.shapes.size());
  for (std::size_t k = 0; k < a.writes.size(); ++k) {
    const store::Write& x = a.writes[k];
    const store::Write& y = b.writes[k];
    ASSERT_EQ(x.kind, y.kind);
    ASSERT_EQ(x.state.id, y.state.id);
    ASSERT_EQ(x.state.written_by, y.state.written_by);
    if (x.kind == store::WriteKind::remove) continue;
    ASSERT_EQ(store::words_of(x.state.row.motion), store::words_of(y.state.row.motion));
    ASSERT_EQ(x.unchanged, y.unchanged);
    ASSERT_EQ(x.base_version_low, y.base_version_low);
    if (x.kind == store::WriteKind::update_motion) continue;
    ASSERT_EQ(x.state.row.geometry, y.state.row.geometry);
    ASSERT_EQ(x.state.row.scale, y.state.row.scale);
    ASSERT_EQ(x.state.row.mask, y.state.row.mask);
    ASSERT_EQ(x.state.row.material, y.state.row.material);
    ASSERT_EQ(x.state.row.light, y.state.row.light);
  }
  for (std::size_t k = 0; k < a.shapes.size(); ++k) {
    ASSERT_EQ(a.shapes[k].geometry, b.shapes[k].geometry);
    ASSERT_TRUE(std::ranges::equal(a.shapes[k].positions_m, b.shapes[k].positions_m));
    ASSERT_EQ(b.shapes[k].given, b.shapes[k].positions_m.size());
    ASSERT_EQ(b.shapes[k].space, b.shapes[k].positions_m.size());
  }
}

LoggedGeometry geometry_named(const std::string& name) {
  return {
      {7}, name, {.deforms = true, .retained_shapes = 3, .rebuild_growth = 2.5f}, 12, 0x1122'3344'5566'7788};
}

TEST(LogRecord, CommitsRoundTrip) {
  RandomSets random(1);
  RecordDecoder decoder;  // shared by all rounds: only the time of the previous commit may carry over
  std::optional<WorldTime> previous_time;
  int moves = 0, without_time = 0;
  for (int round = 0; round < 4000; ++round) {
    store::WriteSet set = round % 2 == 0 ? random.set(20) : random.move();
    if (previous_time && random.below(2) == 0) set.time = *previous_time;
    for (store::Write& write : set.writes)
      if ((write.unchanged >> 13 & 1) == 0 && random.below(2) == 0)
        write.state.row.motion.valid_from = set.time;
    const CommitEncoding form = encoding_of(set, previous_time);
    const Bytes bytes = bytes_of(set, form);
    moves += form.kind == RecordKind::move ? 1 : 0;
    without_time += (form.omitted_words & same_world_time) != 0 ? 1 : 0;
    previous_time = set.time;
    ASSERT_LE(bytes.size(), max_commit_bytes(set));
    ASSERT_LE(bytes.size(), commit_record_encoding(set).bytes);
    ASSERT_EQ(bytes.size() % 8, 0u);
    ASSERT_EQ(decoder.decode(bytes), nullptr) << "round " << round;
    ASSERT_EQ(decoder.bytes(), bytes.size());
    ASSERT_EQ(decoder.record().kind, RecordKind::commit);
    expect_same(set, decoder.record().commit);
  }
  EXPECT_GE(moves, 2000);
  EXPECT_GT(without_time, 500);
}

TEST(LogRecord, MoveWithWorldTimeTakes32Bytes) {
  const WorldTime now = world_time_ns(5);
  EXPECT_EQ(bytes_of(move(9, now), now).size(), 32u);
  EXPECT_EQ(bytes_of(move(9, now), world_time_ns(4)).size(), 40u);
  EXPECT_EQ(bytes_of(move(9, now)).size(), 40u);
  store::WriteSet also_later = move(9, now);
  also_later.writes[0].unchanged &= ~valid_from_word;
  EXPECT_EQ(bytes_of(also_later, world_time_ns(4)).size(), 48u);
  also_later.writes[0].state.row.motion.valid_from = now;
  EXPECT_EQ(bytes_of(also_later, world_time_ns(4)).size(), 40u) << "the world time replaces the word";
  EXPECT_EQ(commit_record_encoding(also_later).bytes, 56u) << "in a commit record too";
}

TEST(LogRecord, LargeVersionIsEncodedAsCommit) {
  RecordDecoder decoder;
  for (const Version version : {Version{max_move_version}, Version{max_move_version + 1}, ~Version{0}}) {
    const store::WriteSet set = move(version, world_time_ns(5));
    const Bytes bytes = bytes_of(set);
    EXPECT_EQ(kind_of(bytes), version <= max_move_version ? RecordKind::move : RecordKind::commit);
    ASSERT_EQ(decoder.decode(bytes), nullptr);
    expect_same(set, decoder.record().commit);
  }
}

TEST(LogRecord, MoveWithoutWorldTimeIsRefused) {
  const WorldTime now = world_time_ns(5);
  const Bytes without_time = bytes_of(move(9, now), now);
  RecordDecoder decoder;
  EXPECT_NE(decoder.decode(without_time), nullptr);
  EXPECT_EQ(RecordDecoder(now).decode(without_time), nullptr);
  Bytes discarded(discard_bytes), gap(gap_bytes);
  encode_discard(8, discarded);
  encode_gap(7, 8, gap);
  const std::pair<Bytes, bool> between[] = {
      {bytes_of(geometry_named("a name")), true}, {discarded, false}, {gap, false}};
  for (const auto& [record, keeps_time] : between) {
    ASSERT_EQ(decoder.decode(bytes_of(move(8, now))), nullptr);
    ASSERT_EQ(decoder.decode(record), nullptr);
    EXPECT_EQ(decoder.decode(without_time) == nullptr, keeps_time) << "after kind " << int(kind_of(record));
  }
}

TEST(LogRecord, InvalidMoveIsRefused) {
  const WorldTime now = world_time_ns(5);
  const auto refused = [&](const auto& change) {
    Bytes bytes = bytes_of(move(9, now));
    EXPECT_EQ(RecordDecoder().decode(bytes), nullptr);
    RecordHeader header;
    MoveBody body;
    std::int64_t time_ns = 5;
    std::byte* const at = bytes.data() + sizeof header;
    std::memcpy(&header, bytes.data(), sizeof header);
    std::memcpy(&body, at, sizeof body);
    change(header, body, time_ns);
    std::memcpy(bytes.data(), &header, sizeof header);
    std::memcpy(at, &body, sizeof body);
    std::memcpy(at + sizeof body, &time_ns, sizeof time_ns);
    return RecordDecoder().decode(bytes) != nullptr;
  };
  using Header = RecordHeader;
  EXPECT_FALSE(refused([](Header&, MoveBody&, std::int64_t&) {}));
  EXPECT_TRUE(refused([](Header&, MoveBody& body, std::int64_t&) { body.version &= ~max_move_version; }));
  EXPECT_TRUE(refused([](Header&, MoveBody& body, std::int64_t&) { body.index = max_entities; }));
  EXPECT_TRUE(refused([](Header&, MoveBody&, std::int64_t& time_ns) { time_ns = max_world_time_ns + 1; }));
  EXPECT_TRUE(refused([](Header& header, MoveBody&, std::int64_t&) { header.omitted_words ^= 2; }));
  EXPECT_TRUE(refused([](Header& header, MoveBody&, std::int64_t&) {
    const std::uint32_t omitted_words =
        header.omitted_words | valid_from_is_world_time;  // both reasons, with the same number of words
    header.omitted_words = static_cast<std::uint16_t>(omitted_words & ~2u);
  }));
  EXPECT_TRUE(refused([](Header& header, MoveBody&, std::int64_t&) { header.kind = RecordKind::gap; }));
  EXPECT_TRUE(refused([](Header& header, MoveBody&, std::int64_t&) { header.kind = RecordKind::commit; }));
}

TEST(LogRecord, MotionHoldsOnlyChangedWords) {
  RandomSets random(6);
  store::WriteSet set{9, world_time_ns(0), {{store::WriteKind::update_motion, {{1, 1}, random.row(), 9}}}};
  EXPECT_EQ(commit_record_encoding(set).bytes, max_commit_bytes(set));
  EXPECT_EQ(commit_record_encoding(set).bytes, 48u + 112u);
  set.writes[0].unchanged = store::all_motion_words & ~0b1'0000'0000'0001u;
  EXPECT_EQ(commit_record_encoding(set).bytes, 48u + 16u);
  EXPECT_EQ(max_commit_bytes(set), 48u + 112u);
  set.writes[0].unchanged = store::all_motion_words;
  EXPECT_EQ(commit_record_encoding(set).bytes, 48u);
}

TEST(LogRecord, WordsAreCounted) {
  for (std::uint32_t mask = 0; mask <= 0xFFFFu; ++mask)
    ASSERT_EQ(store::count_of_words(static_cast<std::uint16_t>(mask)),
              static_cast<std::uint32_t>(std::popcount(mask)));
}

TEST(LogRecord, InvalidOmittedWordsAreRefused) {
  RecordDecoder decoder;
  const auto refused = [&](std::uint32_t what, std::size_t words) {
    store::WriteSet set{9, world_time_ns(0), {{store::WriteKind::update_motion, {{1, 1}, {}, 9}}}};
    Bytes bytes = bytes_of(set, commit_record_encoding(set));
    bytes.resize(48 + 8 * words);
    const std::size_t at = sizeof(RecordHeader) + sizeof(CommitBody) + offsetof(StoredWrite, what);
    std::memcpy(bytes.data() + at, &what, sizeof what);
    const auto length = static_cast<std::uint32_t>(bytes.size());
    std::memcpy(bytes.data() + offsetof(RecordHeader, bytes), &length, sizeof length);
    return decoder.decode(bytes) != nullptr;
  };
  EXPECT_FALSE(refused(0, 14));
  EXPECT_FALSE(refused(0x2001 | 77u << 16, 12));
  EXPECT_TRUE(refused(0x2001 | 77u << 16, 11)) << "too short";
  EXPECT_TRUE(refused(0x2001 | 77u << 16, 13)) << "too long";
  EXPECT_FALSE(refused(0x4000, 13)) << "valid from the world time";
  EXPECT_TRUE(refused(0x4000 | 77u << 16, 13)) << "a base version, and only the world time omitted";
  EXPECT_TRUE(refused(0x6000 | 77u << 16, 12)) << "the last word omitted for two reasons";
  EXPECT_TRUE(refused(0x8000, 13)) << "a word that motions do not have";
  EXPECT_TRUE(refused(77u << 16, 14)) << "a base version, and nothing omitted";
}

TEST(LogRecord, GeometriesRoundTrip) {
  RecordDecoder decoder;
  for (const std::size_t length : {0, 1, 7, 8, 9, 4096}) {
    const LoggedGeometry geometry = geometry_named(std::string(length, 'x'));
    const Bytes bytes = bytes_of(geometry);
    ASSERT_EQ(decoder.decode(bytes), nullptr);
    const LoggedGeometry& back = decoder.record().geometry;
    EXPECT_EQ(back.id, geometry.id);
    EXPECT_EQ(back.name, geometry.name);
    EXPECT_EQ(back.file, geometry.file);
    EXPECT_EQ(back.file_checksum, geometry.file_checksum);
    EXPECT_EQ(back.options.deforms, geometry.options.deforms);
    EXPECT_EQ(back.options.retained_shapes, geometry.options.retained_shapes);
    EXPECT_EQ(back.options.rebuild_growth, geometry.options.rebuild_growth);
  }
}

TEST(LogRecord, DiscardedVersionsAndGapsRoundTrip) {
  RecordDecoder decoder;
  Bytes bytes(discard_bytes);
  encode_discard(77, bytes);
  ASSERT_EQ(decoder.decode(bytes), nullptr);
  EXPECT_EQ(decoder.record().kind, RecordKind::discarded);
  EXPECT_EQ(decoder.record().version, 77u);
  bytes.resize(gap_bytes);
  encode_gap(78, 99, bytes);
  ASSERT_EQ(decoder.decode(bytes), nullptr);
  EXPECT_EQ(decoder.record().kind, RecordKind::gap);
  EXPECT_EQ(decoder.record().version, 78u);
  EXPECT_EQ(decoder.record().to, 99u);
  encode_gap(99, 78, bytes);
  EXPECT_NE(decoder.decode(bytes), nullptr);
}

TEST(LogRecord, TruncatedRecordIsRefused) {
  RandomSets random(2);
  RecordDecoder decoder;
  for (int round = 0; round < 50; ++round) {
    const Bytes bytes = bytes_of(random.set(3));
    for (std::size_t count = 0; count < bytes.size(); ++count) {
      const Bytes cut(bytes.begin(),
                      bytes.begin() + static_cast<std::ptrdiff_t>(
                                          count));  // the address sanitizer detects reads beyond it
      ASSERT_NE(decoder.decode(cut), nullptr) << count << " of " << bytes.size();
    }
  }
}

TEST(LogRecord, WrongLengthIsRefused) {
  RandomSets random(3);
  RecordDecoder decoder;
  for (int round = 0; round < 200; ++round) {
    Bytes bytes = bytes_of(random.set(3));
    RecordHeader header;
    std::memcpy(&header, bytes.data(), sizeof header);
    header.bytes -= 8;
    std::memcpy(bytes.data(), &header, sizeof header);
    ASSERT_NE(decoder.decode(bytes), nullptr);
    header.bytes += 16;
    std::memcpy(bytes.data(), &header, sizeof header);
    bytes.resize(bytes.size() + 8);
    ASSERT_NE(decoder.decode(bytes), nullptr);
  }
}

// A changed record is refused, or encoding it again gives exactly its bytes.
TEST(LogRecord, AcceptedRecordsEncodeToTheSameBytes) {
  RandomSets random(4);
  const LoggedMaterial material{{7}, "paint", {.retro_gain = 300.0, .base_color{0.1, 0.2, 0.3}}};
  const LoggedLight light{
      {7}, "lamp", {.kind = LightKind::spot, .intensity_cd = 5.0, .outer_angle_rad = 0.5}};
  int accepted = 0;
  for (int round = 0; round < 20'000; ++round) {
    Bytes bytes = round % 10 == 0   ? bytes_of(geometry_named("a name"))
                  : round % 10 == 1 ? bytes_of(material)
                  : round % 10 == 2 ? bytes_of(light)
                  : round % 3 == 0  ? bytes_of(random.move())
                                    : bytes_of(random.set(3));
    for (std::uint32_t k = 1 + random.below(3); k > 0; --k) {
      std::byte& changed = bytes[random.below(static_cast<std::uint32_t>(bytes.size()))];
      changed =
          random.below(2) == 0 ? changed ^ std::byte(1u << random.below(8)) : std::byte(random.below(256));
    }
    RecordDecoder decoder;  // without a previous commit
    if (decoder.decode(bytes) != nullptr) continue;
    ++accepted;
    const Record& record = decoder.record();
    const bool as_commit = kind_of(bytes) == RecordKind::commit;  // a move may be a commit record too
    const Bytes again =
        as_commit ? bytes_of(record.commit, commit_record_encoding(record.commit)) : bytes_of(record);
    bytes.resize(decoder.bytes());
    ASSERT_EQ(again, bytes) << "round " << round;
  }
  EXPECT_GT(accepted, 100);
}

TEST(LogRecord, InvalidRowsAreRefused) {
  RandomSets random(5);
  RecordDecoder decoder;
  const auto refused = [&](const auto& change) {
    store::WriteSet set{1, world_time_ns(0), {{store::WriteKind::update, {{1, 1}, random.row(), 1}}}};
    EXPECT_EQ(decoder.decode(bytes_of(set)), nullptr);
    change(set);
    return decoder.decode(bytes_of(set)) != nullptr;
  };
  EXPECT_TRUE(
      refused([](store::WriteSet& set) { set.writes[0].state.row.motion.p_world_m.x = std::nan(""); }));
  EXPECT_TRUE(refused([](store::WriteSet& set) { set.writes[0].state.row.motion.q_world *= 1.001; }));
  EXPECT_TRUE(refused([](store::WriteSet& set) { set.writes[0].state.row.scale.y = 0.0; }));
  EXPECT_TRUE(refused([](store::WriteSet& set) { set.writes[0].state.row.geometry.index = max_geometries; }));
  EXPECT_TRUE(refused([](store::WriteSet& set) { set.writes[0].state.id.index = max_entities; }));
  EXPECT_TRUE(refused([](store::WriteSet& set) { set.time = WorldTime::max(); }));
  EXPECT_TRUE(refused([](store::WriteSet& set) { set.version = 0; }));
  EXPECT_TRUE(refused([](store::WriteSet& set) { set.writes.clear(); }));
}

}  // namespace
}  // namespace rtstdb::log::test
