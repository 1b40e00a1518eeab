#include "io/modbus/register_bank.hpp"

#include <algorithm>
#include <array>
#include <new>
#include <span>

#include "io/modbus/require.hpp"

namespace hil::io::modbus {

RegisterBank::RegisterBank(const RegisterMap& map, const std::vector<bool>& client_writes) {
  require(client_writes.size() == map.entries.size(), "RegisterBank: one permission per entry is needed");
  for (const RegisterEntry& entry : map.entries) {
    Extent& extent = extents_[static_cast<std::size_t>(entry.table)];
    const std::uint32_t end = std::uint32_t{entry.address} + width_of(entry.type);
    const std::uint32_t old_end = extent.first + extent.count;
    const std::uint32_t first =
        extent.count == 0 ? entry.address : std::min<std::uint32_t>(extent.first, entry.address);
    extent = {first, std::max(end, extent.count == 0 ? end : old_end) - first};
  }
  const auto of = [&](Table table) { return extent(table); };
  mapping_.reset(modbus_mapping_new_start_address(
      of(Table::coil).first, of(Table::coil).count, of(Table::discrete_input).first,
      of(Table::discrete_input).count, of(Table::holding).first, of(Table::holding).count,
      of(Table::input).first, of(Table::input).count));
  if (mapping_ == nullptr) throw std::bad_alloc();
  for (std::size_t table = 0; table < 4; ++table)
    writable_[table].resize(extents_[table].count);
  for (std::size_t index = 0; index < map.entries.size(); ++index) {
    const RegisterEntry& entry = map.entries[index];
    store(entry, entry.safe_value);
    if (!client_writes[index]) continue;
    require(entry.table == Table::coil || entry.table == Table::holding,
            "RegisterBank: clients can only write coils and holding registers");
    const auto first = writable_[static_cast<std::size_t>(entry.table)].begin() +
                       (entry.address - extent(entry.table).first);
    std::fill_n(first, width_of(entry.type), true);
    client_entries_.push_back({index, entry});
  }
}

bool RegisterBank::readable(Table table, std::uint32_t address, std::uint32_t count) const noexcept {
  const Extent& all = extent(table);
  return address >= all.first && address + count <= all.first + all.count;
}

bool RegisterBank::writable(Table table, std::uint32_t address, std::uint32_t count) const noexcept {
  if (!readable(table, address, count)) return false;
  const auto first = writable_[static_cast<std::size_t>(table)].begin() + (address - extent(table).first);
  return std::all_of(first, first + count, [](bool allowed) { return allowed; });
}

std::optional<RegisterBank::OutOfRange> RegisterBank::out_of_range(Table table, std::uint32_t address,
                                                                   std::uint32_t count) const noexcept {
  for (const ClientEntry& one : client_entries_) {
    const std::uint32_t first = one.entry.address;
    if (one.entry.table != table || first >= address + count || address >= first + width_of(one.entry.type))
      continue;
    const Decoded decoded = load(one.entry);
    if (decoded.conversion != Conversion::exact) return OutOfRange{one.index, decoded.value};
  }
  return std::nullopt;
}

void RegisterBank::set(Table table, std::uint16_t address, std::uint16_t value) noexcept {
  require(readable(table, address, 1), "RegisterBank::set: an address outside the table");
  const std::uint32_t index = address - extent(table).first;
  const auto bit = static_cast<std::uint8_t>(value != 0);
  switch (table) {
    case Table::coil:
      mapping_->tab_bits[index] = bit;
      break;
    case Table::discrete_input:
      mapping_->tab_input_bits[index] = bit;
      break;
    case Table::holding:
      mapping_->tab_registers[index] = value;
      break;
    case Table::input:
      mapping_->tab_input_registers[index] = value;
      break;
  }
}

std::uint16_t RegisterBank::get(Table table, std::uint16_t address) const noexcept {
  require(readable(table, address, 1), "RegisterBank::get: an address outside the table");
  const std::uint32_t index = address - extent(table).first;
  switch (table) {
    case Table::coil:
      return mapping_->tab_bits[index];
    case Table::discrete_input:
      return mapping_->tab_input_bits[index];
    case Table::holding:
      return mapping_->tab_registers[index];
    case Table::input:
      return mapping_->tab_input_registers[index];
  }
  return 0;
}

Conversion RegisterBank::store(const RegisterEntry& entry, double value) noexcept {
  std::array<std::uint16_t, widest_value> registers{};
  const Conversion conversion = encode(entry, value, registers);
  if (conversion == Conversion::refused) return conversion;
  for (std::uint16_t i = 0; i < width_of(entry.type); ++i) {
    set(entry.table, static_cast<std::uint16_t>(entry.address + i), registers[i]);
  }
  return conversion;
}

Decoded RegisterBank::load(const RegisterEntry& entry) const noexcept {
  std::array<std::uint16_t, widest_value> registers{};
  for (std::uint16_t i = 0; i < width_of(entry.type); ++i) {
    registers[i] = get(entry.table, static_cast<std::uint16_t>(entry.address + i));
  }
  return decode(entry, registers);
}

}  // namespace hil::io::modbus
