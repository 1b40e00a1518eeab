#include "io/modbus/register_map.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <unordered_map>
#include <vector>

#include "io/modbus/register_codec.hpp"

namespace hil::io::modbus {

namespace {

constexpr std::uint32_t addresses_of_a_table = 65536;

std::string number(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

bool clients_can_write(Table table) {
  return table == Table::coil || table == Table::holding;
}

void check_place(const RegisterEntry& entry, const std::string& subject, std::vector<std::string>& mistakes) {
  if (is_bit_table(entry.table) && entry.type != ValueType::boolean) {
    mistakes.push_back(subject + ": the table " + std::string(to_text(entry.table)) +
                       " holds single bits, not " + std::string(to_text(entry.type)) +
                       "; its type has to be bool");
  }
  if (std::uint32_t{entry.address} + width_of(entry.type) > addresses_of_a_table) {
    mistakes.push_back(subject + ": a " + std::string(to_text(entry.type)) + " at address " +
                       std::to_string(entry.address) + " ends beyond the last address, 65535");
  }
}

void check_role(const RegisterEntry& entry, const std::string& subject, Role role,
                std::vector<std::string>& mistakes) {
  if (clients_can_write(entry.table)) return;
  if (role == Role::client && entry.writable) {
    mistakes.push_back(subject + ": a client can not write the table " + std::string(to_text(entry.table)) +
                       "; only coil and holding can be written");
  }
  if (role == Role::server && !entry.writable) {
    mistakes.push_back(subject + ": no client can write the table " + std::string(to_text(entry.table)) +
                       ", so hil can not read it as a server; only coil and holding can be written");
  }
}

void check_numbers(const RegisterEntry& entry, const std::string& subject,
                   std::vector<std::string>& mistakes) {
  const std::size_t before = mistakes.size();
  if (!std::isfinite(entry.scale) || entry.scale == 0.0) {
    mistakes.push_back(subject + ": scale is " + number(entry.scale) +
                       "; it has to be a finite number other than 0");
  }
  if (!std::isfinite(entry.offset)) {
    mistakes.push_back(subject + ": offset is " + number(entry.offset) + "; it has to be a finite number");
  }
  if (!(entry.minimum <= entry.maximum)) {
    mistakes.push_back(subject + ": minimum " + number(entry.minimum) + " is not at or below maximum " +
                       number(entry.maximum));
  }
  if (mistakes.size() != before) return;  // the last check needs valid numbers
  std::array<std::uint16_t, widest_value> registers{};
  if (encode(entry, entry.safe_value, registers) != Conversion::exact) {
    mistakes.push_back(subject + ": safe value " + number(entry.safe_value) +
                       " does not fit between minimum " + number(entry.minimum) + " and maximum " +
                       number(entry.maximum) + " and into the type " + std::string(to_text(entry.type)));
  }
}

std::string subject_of(const RegisterEntry& entry, std::size_t index) {
  if (entry.name.empty()) return "register " + std::to_string(index + 1) + " (without a name)";
  return "register " + entry.name;
}

void check_overlaps(const RegisterMap& map, std::vector<std::string>& mistakes) {
  std::vector<const RegisterEntry*> sorted;
  sorted.reserve(map.entries.size());
  for (const RegisterEntry& entry : map.entries)
    sorted.push_back(&entry);
  std::stable_sort(sorted.begin(), sorted.end(), [](const RegisterEntry* a, const RegisterEntry* b) {
    return a->table != b->table ? a->table < b->table : a->address < b->address;
  });
  const RegisterEntry* furthest = nullptr;  // the entry so far that ends last
  for (const RegisterEntry* entry : sorted) {
    const bool same_table = furthest != nullptr && furthest->table == entry->table;
    const std::uint32_t end = same_table ? std::uint32_t{furthest->address} + width_of(furthest->type) : 0;
    if (same_table && entry->address < end) {
      mistakes.push_back("register " + entry->name + " (" +
                         place_of(entry->table, entry->address, width_of(entry->type)) +
                         ") overlaps register " + furthest->name + " (" +
                         place_of(furthest->table, furthest->address, width_of(furthest->type)) + ")");
    }
    if (!same_table || std::uint32_t{entry->address} + width_of(entry->type) > end) furthest = entry;
  }
}

}  // namespace

const RegisterEntry* RegisterMap::find(std::string_view name) const noexcept {
  const auto found = std::find_if(entries.begin(), entries.end(),
                                  [&](const RegisterEntry& entry) { return entry.name == name; });
  return found == entries.end() ? nullptr : &*found;
}

std::size_t RegisterMap::read_count() const noexcept {
  return static_cast<std::size_t>(std::count_if(entries.begin(), entries.end(),
                                                [](const RegisterEntry& entry) { return !entry.writable; }));
}

std::vector<std::string> mistakes_in(const RegisterMap& map, Role role) {
  std::vector<std::string> mistakes;
  std::unordered_map<std::string, std::size_t> first_of_name;
  for (std::size_t index = 0; index < map.entries.size(); ++index) {
    const RegisterEntry& entry = map.entries[index];
    const std::string subject = subject_of(entry, index);
    if (entry.name.empty()) {
      mistakes.push_back(subject + ": a register needs a name");
    } else if (const auto [first, is_new] = first_of_name.emplace(entry.name, index); !is_new) {
      mistakes.push_back(subject + ": the name is used twice, by entries " +
                         std::to_string(first->second + 1) + " and " + std::to_string(index + 1));
    }
    check_place(entry, subject, mistakes);
    check_role(entry, subject, role, mistakes);
    check_numbers(entry, subject, mistakes);
  }
  check_overlaps(map, mistakes);
  return mistakes;
}

std::uint16_t width_of(ValueType type) noexcept {
  switch (type) {
    case ValueType::boolean:
    case ValueType::u16:
    case ValueType::i16:
      return 1;
    case ValueType::u32:
    case ValueType::i32:
    case ValueType::f32:
      return 2;
    case ValueType::u64:
    case ValueType::i64:
    case ValueType::f64:
      return 4;
  }
  return 1;
}

bool is_bit_table(Table table) noexcept {
  return table == Table::coil || table == Table::discrete_input;
}

std::string_view to_text(Table table) noexcept {
  constexpr std::array<std::string_view, 4> names{"coil", "discrete_input", "holding", "input"};
  return names[static_cast<std::size_t>(table)];
}

std::string_view to_text(ValueType type) noexcept {
  constexpr std::array<std::string_view, 9> names{"bool", "u16", "i16", "u32", "i32",
                                                  "u64",  "i64", "f32", "f64"};
  return names[static_cast<std::size_t>(type)];
}

std::string_view to_text(ByteOrder order) noexcept {
  constexpr std::array<std::string_view, 4> names{"ABCD", "CDAB", "BADC", "DCBA"};
  return names[static_cast<std::size_t>(order)];
}

std::string place_of(Table table, std::uint16_t address, std::uint32_t count) {
  std::string text = std::string(to_text(table)) + " " + std::to_string(address);
  if (count > 1) text += ".." + std::to_string(address + count - 1);
  return text;
}

bool touches(const RegisterEntry& entry, const RequestRange& range) noexcept {
  return entry.table == range.table && entry.address < std::uint32_t{range.address} + range.count &&
         range.address < std::uint32_t{entry.address} + width_of(entry.type);
}

std::string text_of(const RequestRange& range, const RegisterMap& map) {
  constexpr std::size_t max_names = 3;
  std::string names;
  std::size_t count = 0;
  for (const RegisterEntry& entry : map.entries) {
    if (!touches(entry, range)) continue;
    if (++count <= max_names) names += (count > 1 ? ", " : "") + entry.name;
  }
  if (count > max_names) names += " and " + std::to_string(count - max_names) + " more";
  const std::string place = place_of(range.table, range.address, range.count);
  return (range.writes ? "writing " : "reading ") + (count > 0 ? names + " (" + place + ")" : place);
}

}  // namespace hil::io::modbus
