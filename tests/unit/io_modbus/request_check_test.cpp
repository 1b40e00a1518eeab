#include "io/modbus/request_check.hpp"

#include <gtest/gtest.h>

#include <random>

#include "peers.hpp"
#include "registers.hpp"

namespace hil::io::modbus {
namespace {

using test::Bytes;
using test::entry;
using test::frame;

/// holding 10..19: 10..13 can be written, 14..19 only read; coils 0..9 can be written; inputs 0..3.
RegisterBank small_bank() {
  RegisterMap map;
  std::vector<bool> writes;
  const auto add = [&](Table table, std::uint16_t address, ValueType type, bool client_writes) {
    map.entries.push_back(entry("e", table, address, type, false));
    writes.push_back(client_writes);
  };
  add(Table::holding, 10, ValueType::u64, true);
  add(Table::holding, 18, ValueType::u32, false);
  for (std::uint16_t i = 0; i < 10; ++i)
    add(Table::coil, i, ValueType::boolean, true);
  add(Table::input, 0, ValueType::f64, false);
  return {map, writes};
}

TEST(RequestedRange, IsWrittenRangeOrElseTheOneThatIsRead) {
  const auto range_of = [](const Bytes& pdu) { return requested_range(frame(1, pdu)); };
  const RegisterMap none;
  const auto text = [&](const Bytes& pdu) {
    const auto range = range_of(pdu);
    return range ? text_of(*range, none) : std::string("none");
  };
  EXPECT_EQ(text({1, 0, 1, 0, 2}), "reading coil 1..2");
  EXPECT_EQ(text({2, 0, 1, 0, 1}), "reading discrete_input 1");
  EXPECT_EQ(text({3, 1, 0, 0, 1}), "reading holding 256");
  EXPECT_EQ(text({4, 0, 9, 0, 1}), "reading input 9");
  EXPECT_EQ(text({5, 0, 3, 0xFF, 0}), "writing coil 3");
  EXPECT_EQ(text({6, 0, 4, 0, 9}), "writing holding 4");
  EXPECT_EQ(text({15, 0, 3, 0, 9, 2, 0, 0}), "writing coil 3..11");
  EXPECT_EQ(text({16, 0, 7, 0, 1, 2, 0, 0}), "writing holding 7");
  EXPECT_EQ(text({22, 0, 7, 0, 1, 0, 0}), "writing holding 7");
  EXPECT_EQ(text({23, 0, 1, 0, 1, 0, 5, 0, 2, 4}), "writing holding 5..6");
  for (const Bytes& pdu : {Bytes{3}, Bytes{3, 0, 0, 0}, Bytes{23, 0, 0, 0, 1, 0, 1, 0}, Bytes{17},
                           Bytes{99, 0, 0, 0, 0, 0}, Bytes{0x83, 0, 0, 0, 0}})
    EXPECT_FALSE(range_of(pdu)) << "function " << int{pdu[0]};
}

TEST(Framing, PrefixesAreIncomplete) {
  const Bytes whole = frame(0x1234, {3, 0, 10, 0, 4});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    EXPECT_EQ(find_frame(std::span(whole).first(size)).framing, Framing::incomplete) << size;
  }
  EXPECT_EQ(find_frame(whole).framing, Framing::complete);
  EXPECT_EQ(find_frame(whole).size, whole.size());
  Bytes twice = whole;
  twice.insert(twice.end(), whole.begin(), whole.end());
  EXPECT_EQ(find_frame(twice).size, whole.size());
}

TEST(Framing, RefusesInvalidHeadersEarly) {
  EXPECT_EQ(find_frame(Bytes{0, 1, 7}).framing, Framing::invalid);
  EXPECT_EQ(find_frame(Bytes{0, 1, 0, 1}).framing, Framing::invalid);
  EXPECT_EQ(find_frame(Bytes{0, 1, 0, 0, 0, 0}).framing, Framing::invalid);
  EXPECT_EQ(find_frame(Bytes{0, 1, 0, 0, 0, 1}).framing, Framing::invalid);  // a unit, no function
  EXPECT_EQ(find_frame(Bytes{0, 1, 0, 0, 0, 254}).framing, Framing::incomplete);
  EXPECT_EQ(find_frame(Bytes{0, 1, 0, 0, 0, 255}).framing, Framing::invalid);
  EXPECT_EQ(find_frame(Bytes{0, 1, 0, 0, 255, 255}).framing, Framing::invalid);
}

struct Case {
  Bytes pdu;
  int exception;
  const char* what;
};

TEST(RequestCheck, MalformedRequestsGetTheirException) {
  const RegisterBank bank = small_bank();
  const std::vector<Case> cases{
      {{3, 0, 10, 0, 10}, 0, "read all"},
      {{3, 0, 10, 0, 11}, 2, "read beyond the end"},
      {{3, 0, 9, 0, 1}, 2, "read before the start"},
      {{3, 0, 10, 0, 0}, 3, "read nothing"},
      {{3, 0, 10, 0, 126}, 3, "read 126"},
      {{3, 0, 10, 0}, 3, "short read"},
      {{3}, 3, "function alone"},
      {{3, 0, 10, 0, 1, 0}, 3, "long read"},
      {{4, 0, 0, 0, 4}, 0, "read inputs"},
      {{4, 255, 255, 0, 4}, 2, "read around the end of the address space"},
      {{1, 0, 0, 0, 10}, 0, "read coils"},
      {{1, 0, 0, 7, 209}, 3, "read 2001 coils"},
      {{2, 0, 0, 0, 1}, 2, "a table without addresses"},
      {{5, 0, 1, 0xFF, 0}, 0, "coil on"},
      {{5, 0, 1, 0, 1}, 3, "coil with the value 1"},
      {{5, 0, 10, 0xFF, 0}, 2, "missing coil"},
      {{6, 0, 13, 0, 1}, 0, "write one"},
      {{6, 0, 14, 0, 1}, 2, "write between registers"},
      {{6, 0, 18, 0, 1}, 2, "write what is only read"},
      {{6, 0, 13, 0}, 3, "short write"},
      {{16, 0, 10, 0, 2, 4, 1, 2, 3, 4}, 0, "write 2 registers"},
      {{16, 0, 10, 0, 2, 3, 1, 2, 3}, 3, "write 2 registers with three bytes"},
      {{16, 0, 10, 0, 2, 4, 1, 2, 3}, 3, "write 2 registers, one byte missing"},
      {{16, 0, 10, 0, 2, 6, 1, 2, 3, 4, 5, 6}, 3, "write 2 registers, six bytes"},
      {{16, 0, 13, 0, 2, 4, 1, 2, 3, 4}, 2, "write beyond the writable registers"},
      {{16, 0, 10, 0, 124, 248}, 3, "write 124"},
      {{16, 0, 10}, 3, "short write of many"},
      {{15, 0, 0, 0, 10, 2, 255, 3}, 0, "write ten coils"},
      {{15, 0, 0, 0, 10, 1, 255}, 3, "write ten coils with one byte"},
      {{15, 0, 1, 0, 10, 2, 255, 3}, 2, "write ten coils from 1"},
      {{22, 0, 10, 0, 1, 0, 2}, 0, "mask write"},
      {{22, 0, 10, 0, 1, 0}, 3, "short mask write"},
      {{22, 0, 19, 0, 1, 0, 2}, 2, "mask write of what is only read"},
      {{23, 0, 10, 0, 4, 0, 10, 0, 1, 2, 0, 9}, 0, "write and read"},
      {{23, 0, 10, 0, 4, 0, 9, 0, 1, 2, 0, 9}, 2, "write and read before the start (3.1.6 writes there)"},
      {{23, 0, 10, 0, 126, 0, 10, 0, 1, 2, 0, 9}, 3, "write and read 126"},
      {{23, 0, 10, 0, 4, 0, 10, 0, 122, 244}, 3, "write 122 and read"},
      {{23, 0, 10, 0, 4, 0, 10, 0, 2, 2, 0, 9}, 3, "write and read, byte count wrong"},
      {{23, 0, 10, 0, 4}, 3, "short write and read"},
      {{7}, 1, "read exception status"},
      {{17}, 0, "report server id"},
      {{17, 0}, 3, "long report server id"},
      {{43, 14, 1, 0}, 1, "device identification"},
      {{0}, 1, "function 0"},
      {{0x83, 2}, 1, "a reply"}};
  for (const Case& one : cases)
    EXPECT_EQ(check_request(frame(1, one.pdu), bank), one.exception) << one.what;
}

TEST(RequestCheck, WritesChangeTheirRegisters) {
  RegisterBank bank = small_bank();
  auto written = apply_writes(frame(1, {16, 0, 11, 0, 2, 4, 1, 2, 3, 4}), bank);
  ASSERT_TRUE(written.has_value());
  EXPECT_EQ(written->address, 11);
  EXPECT_EQ(written->count, 2);
  EXPECT_EQ(bank.get(Table::holding, 11), 0x0102);
  EXPECT_EQ(bank.get(Table::holding, 12), 0x0304);
  apply_writes(frame(1, {22, 0, 11, 0, 0xF0, 0, 0x0F}), bank);
  EXPECT_EQ(bank.get(Table::holding, 11), (0x0102 & 0x00F0) | (0x000F & ~0x00F0));
  apply_writes(frame(1, {15, 0, 1, 0, 9, 2, 0b10000001, 0b1}), bank);
  const std::vector<int> expected{0, 1, 0, 0, 0, 0, 0, 0, 1, 1};
  for (std::uint16_t i = 0; i < 10; ++i)
    EXPECT_EQ(bank.get(Table::coil, i), expected[i]) << i;
  apply_writes(frame(1, {5, 0, 1, 0, 0}), bank);
  EXPECT_EQ(bank.get(Table::coil, 1), 0);
  EXPECT_FALSE(apply_writes(frame(1, {3, 0, 10, 0, 1}), bank).has_value());
  EXPECT_FALSE(apply_writes(frame(1, {17}), bank).has_value());
}

TEST(RequestCheck, RandomRequestsWriteOnlyWritableRegisters) {
  std::mt19937 random(31337);
  RegisterBank bank = small_bank();
  const std::array<std::uint8_t, 12> functions{1, 2, 3, 4, 5, 6, 7, 15, 16, 17, 22, 23};
  int valid = 0;
  for (int round = 0; round < 200'000; ++round) {
    Bytes pdu{functions[random() % functions.size()]};
    const std::size_t length = random() % 14;
    for (std::size_t i = 0; i < length; ++i) {
      // Mostly small numbers, so that many addresses and counts are valid.
      pdu.push_back(static_cast<std::uint8_t>(random() % 3 == 0 ? random() : i % 2 == 0 ? 0 : random() % 20));
    }
    const Bytes bytes = frame(static_cast<std::uint16_t>(random()), pdu);
    ASSERT_EQ(find_frame(bytes).framing, Framing::complete);
    if (check_request(bytes, bank) != 0) continue;
    ++valid;
    apply_writes(bytes, bank);
  }
  EXPECT_GT(valid, 1000);
  for (std::uint16_t address = 14; address < 20; ++address) {
    EXPECT_EQ(bank.get(Table::holding, address), 0) << "a client wrote it";
  }
}

}  // namespace
}  // namespace hil::io::modbus
