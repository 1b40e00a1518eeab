#include "configs/crossing/plc/plc_registers.hpp"

#include <string>

namespace hil::crossing::plc {

namespace {

using modbus::Table;
using modbus::ValueType;

modbus::RegisterEntry entry(std::string name, Table table, std::uint16_t address, ValueType type,
                            std::string unit = "") {
  modbus::RegisterEntry made;
  made.name = std::move(name);
  made.table = table;
  made.address = address;
  made.type = type;
  made.unit = std::move(unit);
  return made;
}

modbus::RegisterEntry written(modbus::RegisterEntry made) {
  made.writable = true;
  return made;
}

modbus::RegisterEntry words_reversed(modbus::RegisterEntry made) {
  made.order = modbus::ByteOrder::cdab;
  return made;
}

modbus::RegisterEntry scaled(modbus::RegisterEntry made, double scale) {
  made.scale = scale;
  return made;
}

}  // namespace

modbus::RegisterMap register_map() {
  return {{
      written(entry("detector_ego", Table::holding, 0, ValueType::u16)),
      written(entry("detector_cross_right", Table::holding, 1, ValueType::u16)),
      written(entry("detector_cross_left", Table::holding, 2, ValueType::u16)),
      written(entry("heartbeat_hil", Table::holding, 3, ValueType::u16)),
      entry("override_mode", Table::holding, 4, ValueType::u16),
      written(words_reversed(entry("bench_time_ms", Table::holding, 10, ValueType::u32, "ms"))),
      entry("light_ego", Table::input, 0, ValueType::u16),
      entry("light_cross", Table::input, 1, ValueType::u16),
      entry("fault", Table::input, 2, ValueType::u16),
      scaled(entry("green_remaining", Table::input, 3, ValueType::i16, "s"), 0.01),
      entry("scan_count", Table::input, 4, ValueType::u16),
      words_reversed(entry("plc_time_ms", Table::input, 6, ValueType::u32, "ms")),
      entry("demand_ego", Table::discrete_input, 0, ValueType::boolean),
      entry("demand_cross", Table::discrete_input, 1, ValueType::boolean),
  }};
}

}  // namespace hil::crossing::plc
