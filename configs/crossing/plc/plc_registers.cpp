#include "configs/crossing/plc/plc_registers.hpp"

#include <string>

namespace hil::crossing::plc {

namespace {

using modbus::Table;
using modbus::ValueType;

modbus::RegisterEntry register_at(std::string name, Table table, std::uint16_t address, ValueType type,
                                  std::string unit = "") {
  modbus::RegisterEntry entry;
  entry.name = std::move(name);
  entry.table = table;
  entry.address = address;
  entry.type = type;
  entry.unit = std::move(unit);
  return entry;
}

modbus::RegisterEntry written(modbus::RegisterEntry entry) {
  entry.writable = true;
  return entry;
}

modbus::RegisterEntry words_reversed(modbus::RegisterEntry entry) {
  entry.order = modbus::ByteOrder::cdab;
  return entry;
}

modbus::RegisterEntry scaled(modbus::RegisterEntry entry, double scale) {
  entry.scale = scale;
  return entry;
}

}  // namespace

modbus::RegisterMap register_map() {
  return {{
      written(register_at("detector_ego", Table::holding, 0, ValueType::u16)),
      written(register_at("detector_cross_right", Table::holding, 1, ValueType::u16)),
      written(register_at("detector_cross_left", Table::holding, 2, ValueType::u16)),
      written(register_at("heartbeat_hil", Table::holding, 3, ValueType::u16)),
      register_at("override_mode", Table::holding, 4, ValueType::u16),
      written(words_reversed(register_at("bench_time_ms", Table::holding, 10, ValueType::u32, "ms"))),
      register_at("light_ego", Table::input, 0, ValueType::u16),
      register_at("light_cross", Table::input, 1, ValueType::u16),
      register_at("fault", Table::input, 2, ValueType::u16),
      scaled(register_at("green_remaining", Table::input, 3, ValueType::i16, "s"), 0.01),
      register_at("scan_count", Table::input, 4, ValueType::u16),
      words_reversed(register_at("plc_time_ms", Table::input, 6, ValueType::u32, "ms")),
      register_at("demand_ego", Table::discrete_input, 0, ValueType::boolean),
      register_at("demand_cross", Table::discrete_input, 1, ValueType::boolean),
  }};
}

}  // namespace hil::crossing::plc
