#include <algorithm>

#include <hil/require.hpp>

#include "runtime/contract/value_data.hpp"

namespace hil::config {
namespace {

const Value* find(const Value::Data& data, std::string_view field) {
  const auto found = std::find_if(data.entries.begin(), data.entries.end(),
                                  [&](const auto& entry) { return entry.first == field; });
  return found == data.entries.end() ? nullptr : &found->second;
}

bool has_fields(Kind kind) {
  return kind == Kind::record || kind == Kind::map || kind == Kind::choice;
}

}  // namespace

Kind Value::kind() const noexcept {
  return data_->kind;
}
const Place& Value::place() const noexcept {
  return data_->place;
}

const std::string& Value::text() const {
  require(data_->kind == Kind::text || data_->kind == Kind::file, "text() of a text or file");
  return data_->text;
}

Place Value::place_in_text(std::size_t index) const {
  require(data_->kind == Kind::text, "place_in_text() of a text");
  if (data_->is_default || !data_->tree) return data_->place;
  return data_->tree->source->place_in_scalar(data_->tree->position, data_->text, index);
}

bool Value::boolean() const {
  require(data_->kind == Kind::boolean, "boolean() of a boolean");
  return data_->boolean;
}

std::int64_t Value::integer() const {
  require(data_->kind == Kind::integer, "integer() of an integer");
  return data_->integer;
}

double Value::number() const {
  require(data_->kind == Kind::number || data_->kind == Kind::quantity, "number() of a number or quantity");
  return data_->number;
}

std::int64_t Value::duration_ns() const {
  require(data_->nanoseconds.has_value(), "duration_ns() of a duration");
  return data_->nanoseconds.value_or(0);
}

const std::vector<Value>& Value::items() const {
  require(data_->kind == Kind::list, "items() of a list");
  return data_->items;
}

bool Value::has(std::string_view field) const {
  require(has_fields(data_->kind), "has() of something with fields");
  return find(*data_, field) != nullptr;
}

const Value& Value::operator[](std::string_view field) const {
  require(has_fields(data_->kind), "[] of something with fields");
  const Value* const found = find(*data_, field);
  require(found != nullptr, "[] of a field that is there; ask has() for an optional one");
  return *found;
}

const std::vector<std::pair<std::string, Value>>& Value::entries() const {
  require(has_fields(data_->kind), "entries() of something with fields");
  return data_->entries;
}

const Place& Value::key_place(std::size_t index) const {
  require(has_fields(data_->kind) && index < data_->key_places.size(), "key_place() of one of the entries");
  return data_->key_places[index];
}

const std::string& Value::chosen() const {
  require(!data_->chosen.empty(), "chosen() of a choice or exactly_one");
  return data_->chosen;
}

}  // namespace hil::config
