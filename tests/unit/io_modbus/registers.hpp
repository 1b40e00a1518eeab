#pragma once
// Entries of register maps, and what a device has received in them.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "io/device.hpp"
#include "io/modbus/register_map.hpp"

namespace hil::io::modbus::test {

/// "r7"
inline std::string numbered(const char* letter, std::size_t number) {
  std::string text(letter);
  text += std::to_string(number);
  return text;
}

inline RegisterEntry entry(std::string name, Table table, std::uint16_t address, ValueType type,
                           bool writable) {
  RegisterEntry made;
  made.name = std::move(name);
  made.table = table;
  made.address = address;
  made.type = type;
  made.writable = writable;
  return made;
}

inline std::vector<Sample> latched(Device& device) {
  std::vector<Sample> samples(device.inputs().size());
  device.latch_inputs(samples);
  return samples;
}

}  // namespace hil::io::modbus::test
