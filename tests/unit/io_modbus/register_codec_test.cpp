#include "io/modbus/register_codec.hpp"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <random>
#include <string>

#include "registers.hpp"

namespace hil::io::modbus {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

constexpr std::array all_orders{ByteOrder::abcd, ByteOrder::cdab, ByteOrder::badc, ByteOrder::dcba};
constexpr std::array all_types{ValueType::u16, ValueType::i16, ValueType::u32, ValueType::i32,
                               ValueType::u64, ValueType::i64, ValueType::f32, ValueType::f64};

RegisterEntry entry_of(ValueType type, ByteOrder order) {
  RegisterEntry entry = test::entry("value", Table::holding, 0, type, true);
  entry.order = order;
  return entry;
}

/// The layout as it is written in manuals: letters, A the most significant byte.
std::string letters_of(ByteOrder order, std::size_t bytes) {
  static const std::map<std::pair<ByteOrder, std::size_t>, std::string> layouts{
      {{ByteOrder::abcd, 2}, "AB"},       {{ByteOrder::cdab, 2}, "AB"},
      {{ByteOrder::badc, 2}, "BA"},       {{ByteOrder::dcba, 2}, "BA"},
      {{ByteOrder::abcd, 4}, "ABCD"},     {{ByteOrder::cdab, 4}, "CDAB"},
      {{ByteOrder::badc, 4}, "BADC"},     {{ByteOrder::dcba, 4}, "DCBA"},
      {{ByteOrder::abcd, 8}, "ABCDEFGH"}, {{ByteOrder::cdab, 8}, "GHEFCDAB"},
      {{ByteOrder::badc, 8}, "BADCFEHG"}, {{ByteOrder::dcba, 8}, "HGFEDCBA"}};
  return layouts.at({order, bytes});
}

/// Registers of a machine value, by the letters alone.
template <class Machine>
std::vector<std::uint16_t> oracle_registers(Machine value, ByteOrder order) {
  std::array<std::uint8_t, sizeof(Machine)> little{};
  std::memcpy(little.data(), &value, sizeof(Machine));  // this machine is little-endian
  const std::string letters = letters_of(order, sizeof(Machine));
  std::vector<std::uint16_t> registers;
  for (std::size_t i = 0; i < sizeof(Machine); i += 2) {
    const unsigned high = little[sizeof(Machine) - 1 - static_cast<std::size_t>(letters[i] - 'A')];
    const unsigned low = little[sizeof(Machine) - 1 - static_cast<std::size_t>(letters[i + 1] - 'A')];
    registers.push_back(static_cast<std::uint16_t>(high * 256 + low));
  }
  return registers;
}

template <class Machine>
void check_round_trips(ValueType type, std::mt19937_64& random) {
  for (const ByteOrder order : all_orders) {
    const RegisterEntry entry = entry_of(type, order);
    for (int round = 0; round < 2000; ++round) {
      const std::uint64_t bits = random();
      Machine machine{};
      std::memcpy(&machine, &bits, sizeof(Machine));
      if constexpr (std::is_floating_point_v<Machine>) {
        if (!std::isfinite(machine)) continue;
      } else if (sizeof(Machine) == 8) {
        machine = static_cast<Machine>(machine >> 11);  // what a double holds exactly
      }
      const auto value = static_cast<double>(machine);
      std::array<std::uint16_t, widest_value> registers{};
      ASSERT_EQ(encode(entry, value, registers), Conversion::exact) << to_text(type) << " " << value;
      const std::vector<std::uint16_t> expected = oracle_registers(machine, order);
      for (std::size_t i = 0; i < expected.size(); ++i) {
        ASSERT_EQ(registers[i], expected[i]) << to_text(type) << " " << to_text(order) << " register " << i;
      }
      const Decoded back = decode(entry, registers);
      ASSERT_EQ(back.conversion, Conversion::exact);
      ASSERT_EQ(back.value, value);
    }
  }
}

TEST(RegisterCodec, EveryTypeAndOrderHasTheLayoutOfTheManual) {
  std::mt19937_64 random(20240501);
  check_round_trips<std::uint16_t>(ValueType::u16, random);
  check_round_trips<std::int16_t>(ValueType::i16, random);
  check_round_trips<std::uint32_t>(ValueType::u32, random);
  check_round_trips<std::int32_t>(ValueType::i32, random);
  check_round_trips<std::uint64_t>(ValueType::u64, random);
  check_round_trips<std::int64_t>(ValueType::i64, random);
  check_round_trips<float>(ValueType::f32, random);
  check_round_trips<double>(ValueType::f64, random);
}

TEST(RegisterCodec, ScaleAndOffsetRoundTripWithinHalfAStep) {
  std::mt19937_64 random(11);
  std::uniform_real_distribution<double> scales(-2.0, 2.0);
  std::uniform_real_distribution<double> offsets(-100.0, 100.0);
  std::uniform_real_distribution<double> raws(-32768.0, 32767.0);
  for (int round = 0; round < 5000; ++round) {
    RegisterEntry entry = entry_of(ValueType::i16, ByteOrder::abcd);
    entry.scale = scales(random);
    if (entry.scale == 0.0) continue;
    entry.offset = offsets(random);
    const double value = raws(random) * entry.scale + entry.offset;
    std::array<std::uint16_t, widest_value> registers{};
    ASSERT_EQ(encode(entry, value, registers), Conversion::exact);
    ASSERT_NEAR(decode(entry, registers).value, value, std::abs(entry.scale) * 0.5 + 1e-9);
  }
}

TEST(RegisterCodec, RoundsToTheNearestTiesToEven) {
  const RegisterEntry entry = entry_of(ValueType::i16, ByteOrder::abcd);
  const std::vector<std::pair<double, std::int16_t>> cases{
      {0.5, 0}, {1.5, 2}, {2.5, 2}, {-0.5, 0}, {-1.5, -2}, {0.49, 0}, {-32768.5, -32768}, {32767.4, 32767}};
  for (const auto& [value, expected] : cases) {
    std::array<std::uint16_t, widest_value> registers{};
    EXPECT_EQ(encode(entry, value, registers), Conversion::exact) << value;
    EXPECT_EQ(static_cast<std::int16_t>(registers[0]), expected) << value;
  }
}

template <class Integer>
void check_ends(ValueType type) {
  const RegisterEntry entry = entry_of(type, ByteOrder::cdab);
  for (const double beyond : {infinity, 1e300, std::ldexp(1.0, std::numeric_limits<Integer>::digits)}) {
    std::array<std::uint16_t, widest_value> registers{};
    EXPECT_EQ(encode(entry, beyond, registers), Conversion::out_of_range) << to_text(type) << " " << beyond;
    EXPECT_EQ(oracle_registers(std::numeric_limits<Integer>::max(), ByteOrder::cdab)[0], registers[0]);
  }
  for (const double below : {-infinity, -1e300}) {
    std::array<std::uint16_t, widest_value> registers{};
    EXPECT_EQ(encode(entry, below, registers), Conversion::out_of_range) << to_text(type) << " " << below;
    EXPECT_EQ(oracle_registers(std::numeric_limits<Integer>::min(), ByteOrder::cdab)[0], registers[0]);
  }
  std::array<std::uint16_t, widest_value> registers{};
  EXPECT_EQ(encode(entry, static_cast<double>(std::numeric_limits<Integer>::min()), registers),
            Conversion::exact);
}

TEST(RegisterCodec, SaturatesAtTheEndsOfEveryInteger) {
  check_ends<std::uint16_t>(ValueType::u16);
  check_ends<std::int16_t>(ValueType::i16);
  check_ends<std::uint32_t>(ValueType::u32);
  check_ends<std::int32_t>(ValueType::i32);
  check_ends<std::uint64_t>(ValueType::u64);
  check_ends<std::int64_t>(ValueType::i64);
}

TEST(RegisterCodec, SaturatesFloatsToTheLargestFiniteValue) {
  std::array<std::uint16_t, widest_value> registers{};
  const RegisterEntry f32 = entry_of(ValueType::f32, ByteOrder::abcd);
  EXPECT_EQ(encode(f32, 1e39, registers), Conversion::out_of_range);
  EXPECT_EQ(decode(f32, registers).value, static_cast<double>(std::numeric_limits<float>::max()));
  const RegisterEntry f64 = entry_of(ValueType::f64, ByteOrder::abcd);
  EXPECT_EQ(encode(f64, -infinity, registers), Conversion::out_of_range);
  EXPECT_EQ(decode(f64, registers).value, -std::numeric_limits<double>::max());
}

TEST(RegisterCodec, ClampsWhatIsWrittenAndReadsWhatIsThere) {
  RegisterEntry entry = entry_of(ValueType::i16, ByteOrder::abcd);
  entry.scale = 0.1;
  entry.minimum = -5.0;
  entry.maximum = 5.0;
  std::array<std::uint16_t, widest_value> registers{};
  EXPECT_EQ(encode(entry, 7.0, registers), Conversion::out_of_range);
  EXPECT_EQ(registers[0], 50);
  registers[0] = static_cast<std::uint16_t>(-90);
  const Decoded decoded = decode(entry, registers);
  EXPECT_EQ(decoded.conversion, Conversion::out_of_range);
  EXPECT_EQ(decoded.value, -9.0);
}

TEST(RegisterCodec, NanIsRefusedAndLeavesTheRegisters) {
  for (const ValueType type : all_types) {
    std::array<std::uint16_t, widest_value> registers{1, 2, 3, 4};
    EXPECT_EQ(encode(entry_of(type, ByteOrder::abcd), std::nan(""), registers), Conversion::refused)
        << to_text(type);
    EXPECT_EQ(registers, (std::array<std::uint16_t, widest_value>{1, 2, 3, 4})) << to_text(type);
  }
  const std::array<std::uint16_t, 4> nan_f32{0x7FC0, 0, 0, 0};
  EXPECT_EQ(decode(entry_of(ValueType::f32, ByteOrder::abcd), nan_f32).conversion, Conversion::refused);
  const std::array<std::uint16_t, 4> infinite_f64{0x7FF0, 0, 0, 0};
  EXPECT_EQ(decode(entry_of(ValueType::f64, ByteOrder::abcd), infinite_f64).conversion, Conversion::refused);
}

TEST(RegisterCodec, ABooleanIsOneForEverythingButZero) {
  RegisterEntry entry = test::entry("bit", Table::coil, 0, ValueType::boolean, true);
  std::array<std::uint16_t, 1> registers{};
  for (const double value : {1.0, -3.0, 0.1, infinity}) {
    EXPECT_EQ(encode(entry, value, registers), Conversion::exact);
    EXPECT_EQ(registers[0], 1);
  }
  encode(entry, 0.0, registers);
  EXPECT_EQ(registers[0], 0);
  registers[0] = 0x0100;
  entry.table = Table::holding;
  entry.order = ByteOrder::dcba;
  EXPECT_EQ(decode(entry, registers).value, 1.0);
}

TEST(RegisterCodecDeathTest, TooFewRegistersAreMisuse) {
  std::array<std::uint16_t, 1> registers{};
  EXPECT_DEATH(encode(entry_of(ValueType::u32, ByteOrder::abcd), 1.0, registers), "fewer registers");
}

}  // namespace
}  // namespace hil::io::modbus
