#include "io/can/message_coder.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <string_view>

#include "io/can/checksum.hpp"

namespace hil::io::can {
namespace {

const char* const text = R"(BO_ 293 Status: 8 A
 SG_ Speed : 0|16@1+ (0.01,0) [0|600] "m/s" B
 SG_ Angle : 23|16@0- (0.1,0) [-3000|3000] "deg" B
 SG_ Counter : 32|4@1+ (1,0) [0|15] "" B
 SG_ Checksum : 56|8@1+ (1,0) [0|255] "" B
BO_ 2147484000 Pages: 8 A
 SG_ Page M : 0|8@1+ (1,0) [0|255] "" B
 SG_ Left m0 : 8|16@1+ (1,0) [0|0] "" B
 SG_ Right m1 : 8|16@1- (1,0) [0|0] "" B
BO_ 7 Odd: 10 A
 SG_ Value : 72|8@1+ (1,0) [0|0] "" B
BO_ 8 Crossed: 8 A
 SG_ One : 0|9@1+ (1,0) [0|0] "" B
 SG_ Two : 8|8@1+ (1,0) [0|0] "" B
)";

const Dbc& database() {
  static const Dbc parsed = parse_dbc(text).database;
  return parsed;
}
const Protection both{"Counter", "Checksum"};

TEST(Checksum, HasTheStandardsCheckValue) {
  constexpr std::string_view digits = "123456789";
  std::array<std::uint8_t, 9> bytes{};
  std::copy(digits.begin(), digits.end(), bytes.begin());
  EXPECT_EQ(crc8_sae_j1850(bytes), 0x4B);
}

TEST(MessageCoder, CounterAndChecksumAreComputedForEveryFrame) {
  MessageEncoder encoder(*database().find_message("Status"), both);
  MessageDecoder decoder(*database().find_message("Status"), both);
  MessageEncoder::Tally tally;
  for (int round = 0; round < 40; ++round) {
    const std::array<double, 4> values{1.5 * round, -0.3 * round, std::nan(""), 9999.0};
    const Frame frame = encoder.build(values, tally);
    ASSERT_EQ(frame.raw.can_id, 293U);
    ASSERT_EQ(frame.raw.len, 8U);
    // The checksum covers the identifier's low byte and the payload without the checksum.
    std::array<std::uint8_t, 9> covered{293 & 0xFF};
    std::copy_n(frame.raw.data, 7, covered.begin() + 1);
    ASSERT_EQ(frame.raw.data[7], crc8_sae_j1850(covered));
    ASSERT_EQ(frame.raw.data[4] & 0xF, round % 16);
    ASSERT_EQ(decoder.check(frame), MessageDecoder::Verdict::accepted);
    std::array<double, 4> decoded{};
    decoder.decode(frame, [&](std::size_t signal, double value) { decoded[signal] = value; });
    ASSERT_NEAR(decoded[0], values[0], 0.005);
    ASSERT_NEAR(decoded[1], values[1], 0.05);
    ASSERT_EQ(encoder.confirm_sent(), static_cast<std::uint64_t>(round % 16));
  }
  EXPECT_EQ(tally.refused + tally.saturated, 0U) << "values for counter and checksum are ignored";
}

TEST(MessageCoder, CounterAdvancesWhenItsFrameIsSent) {
  MessageEncoder encoder(*database().find_message("Status"), both);
  MessageEncoder::Tally tally;
  const std::array<double, 4> values{};
  EXPECT_EQ(encoder.build(values, tally).raw.data[4], 0);
  EXPECT_EQ(encoder.build(values, tally).raw.data[4], 0);
  encoder.confirm_sent();
  EXPECT_EQ(encoder.build(values, tally).raw.data[4], 1);
}

TEST(MessageCoder, NotANumberKeepsThePreviousValue) {
  MessageEncoder encoder(*database().find_message("Status"), {});
  MessageEncoder::Tally tally;
  const Frame good = encoder.build(std::array<double, 4>{12.0, 3.0, 1.0, 1.0}, tally);
  const Frame kept = encoder.build(std::array<double, 4>{std::nan(""), 3.0, 1.0, 1.0}, tally);
  EXPECT_TRUE(good.same_content(kept));
  EXPECT_EQ(tally.refused, 1U);
  encoder.build(std::array<double, 4>{1e6, 3.0, 1.0, 1.0}, tally);
  EXPECT_EQ(tally.saturated, 1U);
}

TEST(MessageCoder, ChecksumDetectsEveryFlippedBit) {
  MessageEncoder encoder(*database().find_message("Status"), both);
  MessageEncoder::Tally tally;
  const Frame frame = encoder.build(std::array<double, 4>{33.0, 1.0, 0.0, 0.0}, tally);
  for (unsigned bit = 0; bit < 64; ++bit) {
    MessageDecoder decoder(*database().find_message("Status"), both);
    Frame flipped = frame;
    flipped.raw.data[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
    EXPECT_EQ(decoder.check(flipped), MessageDecoder::Verdict::bad_checksum) << "bit " << bit;
  }
}

TEST(MessageCoder, CounterDetectsLostAndRepeatedFrames) {
  MessageEncoder encoder(*database().find_message("Status"), both);
  MessageDecoder decoder(*database().find_message("Status"), both);
  MessageEncoder::Tally tally;
  std::vector<Frame> frames;
  for (int count = 0; count < 6; ++count) {
    frames.push_back(encoder.build(std::array<double, 4>{}, tally));
    encoder.confirm_sent();
  }
  EXPECT_EQ(decoder.check(frames[0]), MessageDecoder::Verdict::accepted);
  EXPECT_EQ(decoder.check(frames[0]), MessageDecoder::Verdict::bad_counter);  // repeated
  EXPECT_EQ(decoder.check(frames[1]), MessageDecoder::Verdict::accepted);
  EXPECT_EQ(decoder.check(frames[3]), MessageDecoder::Verdict::bad_counter);  // 2 was lost
  EXPECT_EQ(decoder.check(frames[4]), MessageDecoder::Verdict::accepted);
  decoder.reset_counter();
  EXPECT_EQ(decoder.check(frames[0]), MessageDecoder::Verdict::accepted);
}

TEST(MessageCoder, CounterMayGoOnByOneMoreForEachFrameWhoseCounterIsNotKnown) {
  constexpr std::uint64_t seed = 74'061;
  std::mt19937_64 random(seed);
  MessageEncoder encoder(*database().find_message("Status"), both);
  MessageDecoder decoder(*database().find_message("Status"), both);
  MessageEncoder::Tally tally;
  using Verdict = MessageDecoder::Verdict;
  int corrupted = 0, tolerated = 0, lost = 0;
  std::uint64_t unknown = 0;
  const auto send = [&] {
    const Frame frame = encoder.build(std::array<double, 4>{}, tally);
    encoder.confirm_sent();
    return frame;
  };
  ASSERT_EQ(decoder.check(send()), Verdict::accepted);
  for (int i = 0; i < 2000; ++i) {
    Frame frame = send();
    const auto kind = random() % 10;
    if (kind < 3) {
      frame.raw.data[random() % 7] ^= static_cast<std::uint8_t>(1U << (random() % 8));
      ASSERT_EQ(decoder.check(frame), Verdict::bad_checksum) << "seed " << seed << ", frame " << i;
      ++unknown;
      ++corrupted;
    } else if (kind == 3) {  // lost: more steps than frames that came
      frame = send();
      ASSERT_EQ(decoder.check(frame), Verdict::bad_counter) << "seed " << seed << ", frame " << i;
      unknown = 0;
      ++lost;
    } else if (kind == 4) {  // repeated: as many steps as none
      ASSERT_EQ(decoder.check(frame), Verdict::accepted) << "seed " << seed << ", frame " << i;
      ASSERT_EQ(decoder.check(frame), Verdict::bad_counter) << "seed " << seed << ", frame " << i;
      unknown = 0;
    } else {
      ASSERT_EQ(decoder.check(frame), Verdict::accepted)
          << "seed " << seed << ", frame " << i << " after " << unknown << " unknown counters";
      tolerated += unknown > 0 ? 1 : 0;
      unknown = 0;
    }
  }
  EXPECT_TRUE(corrupted > 300 && tolerated > 200 && lost > 100);
}

/// The signals of an accepted frame, by index.
std::vector<std::size_t> decoded(MessageDecoder& decoder, const Frame& frame) {
  EXPECT_EQ(decoder.check(frame), MessageDecoder::Verdict::accepted);
  std::vector<std::size_t> signals;
  decoder.decode(frame, [&](std::size_t signal, double) { signals.push_back(signal); });
  return signals;
}

TEST(MessageCoder, ShortFramesUpdateTheirCompleteSignals) {
  MessageDecoder decoder(*database().find_message("Status"), {});
  const std::array<std::uint8_t, 8> bytes{};
  const std::vector<std::vector<std::size_t>> whole{{},        {},        {0},       {0},         {0, 1},
                                                    {0, 1, 2}, {0, 1, 2}, {0, 1, 2}, {0, 1, 2, 3}};
  for (std::size_t length = 0; length <= 8; ++length)
    EXPECT_EQ(decoded(decoder, make_frame(293, std::span(bytes).first(length))), whole[length]) << length;
  EXPECT_EQ(decoder.check(make_frame(293 | CAN_RTR_FLAG, bytes)), MessageDecoder::Verdict::wrong_kind);
}

TEST(MessageCoder, MissingMultiplexerSelectsNoSignals) {
  const Dbc dbc = parse_dbc(
                      "BO_ 1 A: 8 E\n SG_ Page M : 16|8@1+ (1,0) [0|0] \"\" X\n"
                      " SG_ Left m0 : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ Always : 8|8@1+ (1,0) [0|0] \"\" X\n")
                      .database;
  MessageDecoder decoder(dbc.messages.at(0), {});
  const std::array<std::uint8_t, 3> bytes{};
  EXPECT_EQ(decoded(decoder, make_frame(1, std::span(bytes).first(2))), (std::vector<std::size_t>{2}));
  EXPECT_EQ(decoded(decoder, make_frame(1, bytes)), (std::vector<std::size_t>{0, 1, 2}));
}

TEST(MessageCoder, LongFramesCarryEverySignalAndPadding) {
  const Dbc dbc =
      parse_dbc("BO_ 1 A: 4 E\n SG_ V : 0|8@1+ (1,0) [0|0] \"\" X\n SG_ C : 24|8@1+ (1,0) [0|0] \"\" X\n")
          .database;
  MessageEncoder encoder(dbc.messages.at(0), {"", "C"});
  MessageDecoder decoder(dbc.messages.at(0), {"", "C"});
  MessageEncoder::Tally tally;
  Frame frame = encoder.build(std::array<double, 2>{77.0, 0.0}, tally);
  frame.raw.len = 8;
  for (std::size_t byte = 4; byte < 8; ++byte)
    frame.raw.data[byte] = 0xAA;
  EXPECT_EQ(decoded(decoder, frame), (std::vector<std::size_t>{0, 1}))
      << "the checksum is that of the message";
  frame.raw.data[0] ^= 1U;
  EXPECT_EQ(decoder.check(frame), MessageDecoder::Verdict::bad_checksum);
}

TEST(MessageCoder, AFrameTooShortForItsProtectionIsRefused) {
  const std::array<std::uint8_t, 8> bytes{};
  MessageDecoder checked(*database().find_message("Status"), {"", "Checksum"});
  EXPECT_EQ(checked.check(make_frame(293, std::span(bytes).first(7))), MessageDecoder::Verdict::bad_checksum);
  MessageDecoder counted(*database().find_message("Status"), {"Counter", ""});
  EXPECT_EQ(counted.check(make_frame(293, std::span(bytes).first(4))), MessageDecoder::Verdict::bad_counter);
}

TEST(MessageCoder, FrameFormatFollowsTheDatabase) {
  const std::string head =
      "BO_ 256 Short: 8 A\n SG_ V : 0|8@1+ (1,0) [0|0] \"\" B\nBO_ 257 Other: 8 A\n SG_ V : 0|8@1+ (1,0) "
      "[0|0] \"\" B\n";
  const Dbc stated = parse_dbc(head +
                               "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\nBA_DEF_DEF_ \"CANFD_BRS\" 1;\n"
                               "BA_ \"VFrameFormat\" BO_ 256 14;\n")
                         .database;
  MessageEncoder::Tally tally;
  MessageEncoder fd(*stated.find_message("Short"), {});
  const Frame frame = fd.build(std::array<double, 1>{5.0}, tally);
  EXPECT_TRUE(frame.is_fd);
  EXPECT_EQ(frame.raw.flags, CANFD_BRS);
  EXPECT_EQ(frame.raw.len, 8U);
  MessageEncoder classic(*stated.find_message("Other"), {});
  EXPECT_FALSE(classic.build(std::array<double, 1>{5.0}, tally).is_fd);

  const std::array<std::uint8_t, 8> bytes{};
  const Dbc open = parse_dbc(head).database;
  for (const bool is_fd : {false, true}) {
    const auto verdict = [&](const Dbc& dbc, const char* name, canid_t id) {
      return MessageDecoder(*dbc.find_message(name), {}).check(make_frame(id, bytes, is_fd));
    };
    EXPECT_EQ(verdict(stated, "Short", 256),
              is_fd ? MessageDecoder::Verdict::accepted : MessageDecoder::Verdict::wrong_kind);
    EXPECT_EQ(verdict(stated, "Other", 257),
              is_fd ? MessageDecoder::Verdict::wrong_kind : MessageDecoder::Verdict::accepted);
    EXPECT_EQ(verdict(open, "Short", 256), MessageDecoder::Verdict::accepted) << "the file leaves it open";
  }
}

TEST(MessageCoder, OnlySelectedSignalsAreWrittenAndRead) {
  MessageEncoder encoder(*database().find_message("Pages"), {});
  MessageDecoder decoder(*database().find_message("Pages"), {});
  MessageEncoder::Tally tally;
  const Frame frame = encoder.build(std::array<double, 3>{1.0, 500.0, -2.0}, tally);
  EXPECT_EQ(frame.raw.can_id, (352U | CAN_EFF_FLAG));
  EXPECT_EQ(frame.raw.data[1], 0xFE);
  std::vector<std::size_t> seen;
  decoder.decode(frame, [&](std::size_t signal, double value) {
    seen.push_back(signal);
    if (signal == 2) {
      EXPECT_EQ(value, -2.0);
    }
  });
  EXPECT_EQ(seen, (std::vector<std::size_t>{0, 2}));
}

TEST(MessageCoder, LongMessagesBecomeFdFramesOfAValidLength) {
  MessageEncoder encoder(*database().find_message("Odd"), {});
  MessageEncoder::Tally tally;
  const Frame frame = encoder.build(std::array<double, 1>{200.0}, tally);
  EXPECT_TRUE(frame.is_fd);
  EXPECT_EQ(frame.raw.len, 12U);
  EXPECT_EQ(frame.raw.data[9], 200U);
}

TEST(MessageCoder, ReportsWhatCanNotBeCoded) {
  const DbcMessage& status = *database().find_message("Status");
  EXPECT_TRUE(coding_problems(status, both, Use::send).empty());
  EXPECT_EQ(coding_problems(status, {"Nothing", ""}, Use::send).size(), 1U);
  EXPECT_EQ(coding_problems(status, {"Angle", ""}, Use::send).size(), 1U) << "signed";
  EXPECT_EQ(coding_problems(status, {"", "Counter"}, Use::send).size(), 1U) << "4 bits";
  EXPECT_EQ(coding_problems(status, {"Checksum", "Checksum"}, Use::send).size(), 1U);
  const DbcMessage& crossed = *database().find_message("Crossed");
  EXPECT_EQ(coding_problems(crossed, {}, Use::send).size(), 1U);
  EXPECT_TRUE(coding_problems(crossed, {}, Use::receive).empty());
}

}  // namespace
}  // namespace hil::io::can
