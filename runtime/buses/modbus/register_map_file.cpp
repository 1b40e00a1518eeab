#include "runtime/buses/modbus/register_map_file.hpp"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>

#include "runtime/buses/modbus/modbus_schema.hpp"
#include "runtime/config/parse.hpp"
#include "runtime/config/reading.hpp"

namespace hil::buses::modbus {
namespace {

using namespace config;

using io::modbus::ByteOrder;
using io::modbus::RegisterEntry;
using io::modbus::RegisterMap;
using io::modbus::Role;
using io::modbus::Table;
using io::modbus::ValueType;

/// The enumerator that the word names; the schema has made sure that there is one.
template <typename Enum>
Enum find_enumerator(const std::string& word, std::initializer_list<Enum> all) {
  for (const Enum candidate : all) {
    if (io::modbus::to_text(candidate) == word) return candidate;
  }
  return *all.begin();
}

RegisterEntry read_entry(const Value& value) {
  RegisterEntry entry;
  entry.name = value["name"].text();
  entry.table = find_enumerator(value["table"].text(),
                                {Table::coil, Table::discrete_input, Table::holding, Table::input});
  entry.address = static_cast<std::uint16_t>(value["address"].integer());
  entry.type = find_enumerator(
      value["type"].text(), {ValueType::boolean, ValueType::u16, ValueType::i16, ValueType::u32,
                             ValueType::i32, ValueType::u64, ValueType::i64, ValueType::f32, ValueType::f64});
  entry.order = find_enumerator(value["word_order"].text(),
                                {ByteOrder::abcd, ByteOrder::cdab, ByteOrder::badc, ByteOrder::dcba});
  entry.scale = value["scale"].number();
  entry.offset = value["offset"].number();
  if (value.has("unit")) entry.unit = value["unit"].text();
  if (value.has("minimum")) entry.minimum = value["minimum"].number();
  if (value.has("maximum")) entry.maximum = value["maximum"].number();
  entry.safe_value = value["safe"].number();
  entry.writable = value["access"].text() == "write";
  entry.is_optional = value["optional"].boolean();
  return entry;
}

/// The place of the entry that a sentence of mistakes_in begins with.
Place place_in(const std::string& sentence, const RegisterMap& map, const std::vector<Place>& places,
               const Place& list) {
  for (std::size_t i = 0; i < map.entries.size(); ++i) {
    const std::string beginning = "register " + map.entries[i].name;
    if (!sentence.starts_with(beginning) || sentence.size() == beginning.size()) continue;
    if (sentence[beginning.size()] == ':' || sentence[beginning.size()] == ' ') return places[i];
  }
  return list;
}

}  // namespace

std::optional<RegisterMap> load_register_map(const std::string& path, Role role, Diagnostics& diagnostics) {
  const std::size_t mistakes_before = diagnostics.count();
  const std::optional<Value> root = parse_file(path, register_map_schema(), diagnostics);
  if (!root) return std::nullopt;
  RegisterMap map;
  std::vector<Place> places;
  std::set<std::string> names;
  UniqueNames unique("register", diagnostics);
  for (const Value& value : (*root)["registers"].items()) {
    unique.add(word_of(value["name"]));
    if (!names.insert(value["name"].text()).second) continue;
    map.entries.push_back(read_entry(value));
    if (map.entries.back().writable && map.entries.back().is_optional)
      diagnostics.add(
          value["optional"].place(),
          "'optional' has no meaning for a register that hil writes ('access: write'); leave it out");
    places.push_back(value.place());
  }
  for (const std::string& sentence : io::modbus::mistakes_in(map, role)) {
    diagnostics.add(place_in(sentence, map, places, (*root)["registers"].place()), sentence);
  }
  if (diagnostics.count() != mistakes_before) return std::nullopt;
  return map;
}

}  // namespace hil::buses::modbus
