#include "io/can/signal_codec.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>

namespace hil::io::can {
namespace {

DbcSignal make_signal(std::uint16_t start, std::uint16_t length, ByteOrder order,
                      ValueType type = ValueType::unsigned_integer, double factor = 1.0,
                      double offset = 0.0) {
  DbcSignal signal;
  signal.start_bit = start;
  signal.length_bits = length;
  signal.order = order;
  signal.type = type;
  signal.factor = factor;
  signal.offset = offset;
  return signal;
}

/// Reads the layout bit by bit. Intel counts up from the least significant bit; Motorola starts at the most
/// significant bit, counts down inside a byte and continues at bit 7 of the next byte.
std::uint64_t oracle_extract(const DbcSignal& signal, std::span<const std::uint8_t> payload) {
  std::uint64_t raw = 0;
  int byte = signal.start_bit / 8;
  int bit = signal.start_bit % 8;
  for (int index = 0; index < signal.length_bits; ++index) {
    const std::uint64_t value = (payload[static_cast<std::size_t>(byte)] >> bit) & 1U;
    if (signal.order == ByteOrder::intel) {
      raw |= value << index;
      if (++bit == 8) {
        bit = 0;
        ++byte;
      }
    } else {
      raw = (raw << 1U) | value;
      if (--bit < 0) {
        bit = 7;
        ++byte;
      }
    }
  }
  return raw;
}

TEST(SignalCodec, ReadsTheTextbookExamples) {
  const std::array<std::uint8_t, 8> payload{0x12, 0x34, 0x56, 0x78, 0x9A, 0xBC, 0xDE, 0xF0};
  EXPECT_EQ(SignalCodec(make_signal(0, 16, ByteOrder::intel)).extract(payload), 0x3412U);
  EXPECT_EQ(SignalCodec(make_signal(7, 16, ByteOrder::motorola)).extract(payload), 0x1234U);
  EXPECT_EQ(SignalCodec(make_signal(4, 8, ByteOrder::intel)).extract(payload), 0x41U);
  EXPECT_EQ(SignalCodec(make_signal(3, 8, ByteOrder::motorola)).extract(payload), 0x23U);
  EXPECT_EQ(SignalCodec(make_signal(0, 64, ByteOrder::intel)).extract(payload), 0xF0DEBC9A78563412U);
  EXPECT_EQ(SignalCodec(make_signal(7, 64, ByteOrder::motorola)).extract(payload), 0x123456789ABCDEF0U);
}

TEST(SignalCodec, AgreesWithABitByBitReadingForRandomLayouts) {
  std::mt19937_64 random(20240501);
  int checked = 0;
  while (checked < 20000) {
    const std::size_t bytes = random() % 4 == 0 ? 64 : 8;
    const auto order = random() % 2 == 0 ? ByteOrder::intel : ByteOrder::motorola;
    const DbcSignal signal = make_signal(static_cast<std::uint16_t>(random() % (8 * bytes)),
                                         static_cast<std::uint16_t>(1 + random() % 64), order);
    PayloadBits bits;
    if (!bits_of(signal, bits) || (bits >> (8 * bytes)).any()) continue;
    ++checked;
    ASSERT_EQ(bits.count(), signal.length_bits);
    std::array<std::uint8_t, 64> payload{};
    for (std::uint8_t& byte : payload)
      byte = static_cast<std::uint8_t>(random());
    const std::span<std::uint8_t> used(payload.data(), bytes);
    const SignalCodec codec(signal);
    ASSERT_EQ(codec.extract(used), oracle_extract(signal, used))
        << signal.start_bit << "|" << signal.length_bits;

    const std::array<std::uint8_t, 64> before = payload;
    const std::uint64_t raw = random() & codec.mask();
    codec.insert(used, raw);
    ASSERT_EQ(oracle_extract(signal, used), raw);
    for (std::size_t bit = 0; bit < 8 * bytes; ++bit) {  // and no other bit has changed
      if (bits.test(bit)) continue;
      ASSERT_EQ((payload[bit / 8] >> (bit % 8)) & 1U, (before[bit / 8] >> (bit % 8)) & 1U) << "bit " << bit;
    }
  }
}

TEST(SignalCodec, RoundTripsPhysicalValuesWithinHalfAStep) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (int round = 0; round < 20000; ++round) {
    const auto length = static_cast<std::uint16_t>(1 + random() % 32);
    const auto order = random() % 2 == 0 ? ByteOrder::intel : ByteOrder::motorola;
    const auto type = random() % 2 == 0 ? ValueType::unsigned_integer : ValueType::signed_integer;
    const double factor = (random() % 2 == 0 ? 1.0 : -1.0) * std::pow(10.0, 4.0 * unit(random) - 3.0);
    const double offset = 200.0 * unit(random) - 100.0;
    const SignalCodec codec(
        make_signal(order == ByteOrder::intel ? 3 : 5, length, order, type, factor, offset));
    const double low = codec.physical_minimum();
    const double high = codec.physical_maximum();
    const double physical = low + (high - low) * unit(random);
    const SignalCodec::Encoded encoded = codec.to_raw(physical);
    ASSERT_EQ(encoded.verdict, SignalCodec::Verdict::taken);
    ASSERT_EQ(encoded.raw & ~codec.mask(), 0U);
    std::array<std::uint8_t, 8> payload{};
    codec.insert(payload, encoded.raw);
    ASSERT_NEAR(codec.decode(payload), physical, 0.5 * std::abs(factor) * (1.0 + 1e-9) + 1e-9 * (high - low));
  }
}

TEST(SignalCodec, RoundTripsEveryRawValue) {
  for (const auto type : {ValueType::unsigned_integer, ValueType::signed_integer}) {
    for (const double factor : {1.0, 0.01, -0.1, 0.05, 3.7}) {
      const SignalCodec codec(make_signal(0, 12, ByteOrder::intel, type, factor, -51.2));
      for (std::uint64_t raw = 0; raw < 4096; ++raw) {
        const SignalCodec::Encoded again = codec.to_raw(codec.to_physical(raw));
        ASSERT_EQ(again.raw, raw) << factor;
        ASSERT_EQ(again.verdict, SignalCodec::Verdict::taken);
      }
    }
  }
}

TEST(SignalCodec, SaturatesAtTheRawRange) {
  const SignalCodec small(make_signal(0, 8, ByteOrder::intel, ValueType::signed_integer, 0.5, 10.0));
  EXPECT_EQ(small.to_raw(1e9).raw, 0x7FU);
  EXPECT_EQ(small.to_raw(1e9).verdict, SignalCodec::Verdict::saturated);
  EXPECT_EQ(small.to_raw(-1e9).raw, 0x80U);
  EXPECT_EQ(small.to_raw(std::numeric_limits<double>::infinity()).raw, 0x7FU);
  EXPECT_EQ(small.to_raw(73.5).verdict, SignalCodec::Verdict::taken);  // 127 * 0.5 + 10
  EXPECT_EQ(small.to_raw(74.0).verdict, SignalCodec::Verdict::saturated);

  const SignalCodec wide(make_signal(0, 64, ByteOrder::intel));
  EXPECT_EQ(wide.to_raw(18446744073709551616.0).raw, ~std::uint64_t{0});
  EXPECT_EQ(wide.to_raw(-1.0).raw, 0U);
  const SignalCodec wide_signed(make_signal(0, 64, ByteOrder::intel, ValueType::signed_integer));
  EXPECT_EQ(wide_signed.to_raw(9223372036854775808.0).raw, 0x7FFFFFFFFFFFFFFFU);
  EXPECT_EQ(wide_signed.to_raw(-1e300).raw, 0x8000000000000000U);
}

TEST(SignalCodec, SaturatesAtTheRangeOfTheDatabase) {
  DbcSignal signal = make_signal(0, 16, ByteOrder::intel, ValueType::signed_integer, 0.01);
  signal.minimum = -100.0;
  signal.maximum = 100.0;
  const SignalCodec codec(signal);
  EXPECT_EQ(codec.to_raw(100.0).verdict, SignalCodec::Verdict::taken);
  EXPECT_EQ(codec.to_raw(100.0).raw, 10000U);
  EXPECT_EQ(codec.to_raw(100.01).verdict, SignalCodec::Verdict::saturated);
  EXPECT_EQ(codec.to_raw(100.01).raw, 10000U);
  EXPECT_EQ(codec.to_physical(codec.to_raw(-200.0).raw), -100.0);
}

TEST(SignalCodec, AcceptsNamedAndStartValuesOutsideTheRange) {
  DbcSignal signal = make_signal(0, 8, ByteOrder::intel, ValueType::unsigned_integer, 0.5, 10.0);
  signal.minimum = 10.0;
  signal.maximum = 110.0;
  signal.value_names = {{254, "error"}, {3, "three"}, {300, "beyond the bits"}};
  signal.start_raw = 255.0;
  const SignalCodec codec(signal);
  EXPECT_EQ(codec.to_raw(254 * 0.5 + 10.0).raw, 254U);
  EXPECT_EQ(codec.to_raw(254 * 0.5 + 10.0).verdict, SignalCodec::Verdict::taken);
  EXPECT_EQ(codec.to_raw(255 * 0.5 + 10.0).raw, 255U);
  EXPECT_EQ(codec.to_raw(253 * 0.5 + 10.0).verdict, SignalCodec::Verdict::saturated);
  EXPECT_EQ(codec.to_raw(300 * 0.5 + 10.0).raw, 200U) << "the end of the range";
}

TEST(SignalCodec, ReadsRawNumbersWithTheSignOfTheSignal) {
  const DbcSignal plain = make_signal(0, 8, ByteOrder::intel);
  EXPECT_EQ(raw_number(plain, 255.0), 255.0);
  EXPECT_FALSE(raw_number(plain, 256.0));
  EXPECT_FALSE(raw_number(plain, -1.0));
  EXPECT_FALSE(raw_number(plain, 0.5));
  EXPECT_FALSE(raw_number(plain, std::nan("")));
  const DbcSignal with_sign = make_signal(0, 8, ByteOrder::intel, ValueType::signed_integer);
  EXPECT_EQ(raw_number(with_sign, -128.0), -128.0);
  EXPECT_EQ(raw_number(with_sign, 255.0), -1.0) << "written as its bits";
  EXPECT_FALSE(raw_number(with_sign, -129.0));
  const DbcSignal wide = make_signal(0, 64, ByteOrder::intel);
  EXPECT_EQ(raw_number(wide, -1.0), 0x1p64) << "all bits set, rounded to a double";
  const DbcSignal floating = make_signal(0, 32, ByteOrder::intel, ValueType::float32);
  EXPECT_EQ(raw_number(floating, 0.5), 0.5);
}

TEST(SignalCodec, RoundsToNearest) {
  const SignalCodec codec(make_signal(0, 8, ByteOrder::intel, ValueType::signed_integer));
  EXPECT_EQ(codec.to_raw(2.4).raw, 2U);
  EXPECT_EQ(codec.to_raw(2.5).raw, 3U);
  EXPECT_EQ(codec.to_raw(-2.5).raw, 0xFDU);  // -3
  EXPECT_EQ(codec.to_raw(-2.4).raw, 0xFEU);  // -2
}

TEST(SignalCodec, RefusesNotANumber) {
  for (const auto type : {ValueType::unsigned_integer, ValueType::float32, ValueType::float64}) {
    const std::uint16_t length = type == ValueType::float64 ? 64 : 32;
    const SignalCodec codec(make_signal(0, length, ByteOrder::intel, type));
    EXPECT_EQ(codec.to_raw(std::nan("")).verdict, SignalCodec::Verdict::refused);
  }
}

TEST(SignalCodec, EncodesFloatingPoint) {
  std::array<std::uint8_t, 8> payload{};
  const SignalCodec single(make_signal(0, 32, ByteOrder::intel, ValueType::float32));
  single.insert(payload, single.to_raw(-1.5).raw);
  EXPECT_EQ(single.decode(payload), -1.5);
  EXPECT_EQ(payload[3], 0xBF);  // IEEE 754: sign, then exponent
  EXPECT_EQ(single.to_raw(1e300).verdict, SignalCodec::Verdict::saturated);
  EXPECT_TRUE(std::isfinite(single.to_physical(single.to_raw(1e300).raw)));
  const SignalCodec twice(make_signal(7, 64, ByteOrder::motorola, ValueType::float64, 2.0, 1.0));
  twice.insert(payload, twice.to_raw(0.1).raw);
  EXPECT_DOUBLE_EQ(twice.decode(payload), 0.1);
}

TEST(SignalCodecDeathTest, MisuseEndsTheProgram) {
  const SignalCodec codec(make_signal(8, 16, ByteOrder::intel));
  const std::array<std::uint8_t, 2> short_payload{};
  EXPECT_DEATH(codec.extract(short_payload), "payload holds the signal");
}

}  // namespace
}  // namespace hil::io::can
