#include "runtime/report/bus_json.hpp"

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>
#include <variant>

#include "runtime/report/text_safety.hpp"

namespace hil::report {
namespace {

using contribution::BusField;
using contribution::BusRow;
using contribution::BusSentence;
using Json = nlohmann::ordered_json;

constexpr const char* faults_key = "faults";
constexpr const char* remarks_key = "remarks";

Json json_of(std::uint64_t count) {
  return count;
}
Json json_of(double number) {
  return std::isfinite(number) ? Json(number) : Json(nullptr);
}
Json json_of(const std::string& text) {
  return valid_utf8(text);
}
Json json_of(const std::vector<BusRow>& rows) {
  Json list = Json::array();
  for (const BusRow& row : rows) {
    Json object = Json::object();
    for (const auto& [key, value] : row)
      object[key] = std::visit([](const auto& item) { return json_of(item); }, value);
    list.push_back(std::move(object));
  }
  return list;
}
Json json_of(const std::vector<BusSentence>& sentences) {
  Json list = Json::array();
  for (const BusSentence& sentence : sentences) {
    list.push_back({{"count", sentence.count}, {"text", json_of(sentence.text)}});
  }
  return list;
}

std::uint64_t count_at(const JsonCursor& cursor) {
  if (!cursor.json.is_number_unsigned()) cursor.refuse("a count");
  return cursor.json.get<std::uint64_t>();
}

std::string text_at(const JsonCursor& cursor) {
  if (!cursor.json.is_string()) cursor.refuse("text");
  return cursor.json.get<std::string>();
}

const JsonCursor& list_at(const JsonCursor& cursor) {
  if (!cursor.json.is_array()) cursor.refuse("a list");
  return cursor;
}

const JsonCursor& object_at(const JsonCursor& cursor) {
  if (!cursor.json.is_object()) cursor.refuse("an object");
  return cursor;
}

std::vector<BusRow> rows_at(const JsonCursor& list) {
  std::vector<BusRow> rows(list.json.size());
  for (std::size_t index = 0; index < rows.size(); ++index) {
    const JsonCursor item = list.item(index);
    for (const auto& [key, value] : object_at(item).json.items()) {
      const JsonCursor member = item.member(key.c_str());
      if (value.is_string()) {
        rows[index].emplace_back(key, text_at(member));
      } else {
        rows[index].emplace_back(key, count_at(member));
      }
    }
  }
  return rows;
}

BusField field_at(const std::string& key, const JsonCursor& cursor) {
  if (cursor.json.is_string()) return {key, text_at(cursor)};
  if (cursor.json.is_array()) return {key, rows_at(cursor)};
  if (cursor.json.is_null()) return {key, not_known};
  if (cursor.json.is_number_float()) return {key, cursor.json.get<double>()};
  return {key, count_at(cursor)};
}

std::vector<BusSentence> sentences_at(const JsonCursor& list) {
  std::vector<BusSentence> sentences;
  for (std::size_t index = 0; index < list_at(list).json.size(); ++index) {
    const JsonCursor item = list.item(index);
    sentences.push_back({count_at(item.member("count")), text_at(item.member("text"))});
  }
  return sentences;
}

BusRecord record_at(const JsonCursor& cursor, const std::string& name_key) {
  BusRecord record;
  record.name = text_at(cursor.member(name_key.c_str()));
  for (const auto& [key, value] : cursor.json.items()) {
    if (key != name_key && key != faults_key && key != remarks_key)
      record.fields.push_back(field_at(key, cursor.member(key.c_str())));
  }
  record.faults = sentences_at(cursor.member(faults_key));
  record.remarks = sentences_at(cursor.member(remarks_key));
  return record;
}

}  // namespace

void add_bus_lists(const std::vector<BusGroup>& groups, Json& file) {
  for (const BusGroup& group : groups) {
    Json list = Json::array();
    for (const BusRecord& bus : group.buses) {
      Json object = Json::object();
      object[group.name_key] = json_of(bus.name);
      for (const BusField& field : bus.fields)
        object[field.key] = std::visit([](const auto& value) { return json_of(value); }, field.value);
      object[faults_key] = json_of(bus.faults);
      object[remarks_key] = json_of(bus.remarks);
      list.push_back(std::move(object));
    }
    file[group.list_key] = std::move(list);
  }
}

void read_bus_lists(const JsonCursor& file, std::vector<BusGroup>& groups) {
  for (BusGroup& group : groups) {
    const JsonCursor list = file.member(group.list_key.c_str());
    for (std::size_t index = 0; index < list_at(list).json.size(); ++index)
      group.buses.push_back(record_at(list.item(index), group.name_key));
  }
}

}  // namespace hil::report
