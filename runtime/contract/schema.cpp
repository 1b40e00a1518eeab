#include <cmath>
#include <set>
#include <utility>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>
#include <hil/require.hpp>
#include <hil/schema.hpp>

#include "runtime/contract/schema_node.hpp"

namespace hil::config {
namespace {

std::vector<SchemaField> prepare_all(std::vector<Field> fields, std::set<std::string>& names) {
  std::vector<SchemaField> prepared;
  prepared.reserve(fields.size());
  for (Field& field : fields) {
    require(names.insert(field.name).second, "the fields of a record have different names");
    prepared.push_back({.field = std::move(field)});
  }
  return prepared;
}

std::vector<std::string> names_of(const std::vector<SchemaField>& fields) {
  std::vector<std::string> names;
  names.reserve(fields.size());
  for (const SchemaField& field : fields)
    names.push_back(field.field.name);
  return names;
}

std::string range_text(const std::string& minimum, const std::string& maximum) {
  if (minimum.empty()) return maximum.empty() ? "" : "at most " + maximum;
  return maximum.empty() ? "at least " + minimum : "from " + minimum + " to " + maximum;
}

std::string bound(double value) {
  return std::isinf(value) ? "" : format_number(value);
}

std::string bound(double value, Quantity quantity) {
  return std::isinf(value) ? "" : format_limit(value, quantity, units_of(quantity).front());
}

}  // namespace

Schema Schema::text() {
  Node node;
  node.kind = Kind::text;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::name() {
  Node node;
  node.kind = Kind::text;
  node.text_rule = TextRule::name;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::signal() {
  Node node;
  node.kind = Kind::text;
  node.text_rule = TextRule::signal;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::one_of(std::vector<std::string> words) {
  require(!words.empty(), "a closed list has words");
  Node node;
  node.kind = Kind::text;
  node.words = std::move(words);
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::boolean() {
  Node node;
  node.kind = Kind::boolean;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::integer(std::int64_t minimum, std::int64_t maximum) {
  require(minimum <= maximum, "a range is not empty");
  Node node;
  node.kind = Kind::integer;
  node.minimum_integer = minimum;
  node.maximum_integer = maximum;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::number(double minimum, double maximum) {
  require(minimum <= maximum, "a range is not empty");
  Node node;
  node.kind = Kind::number;
  node.minimum = minimum;
  node.maximum = maximum;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::quantity(Quantity quantity, double minimum_si, double maximum_si) {
  require(minimum_si <= maximum_si, "a range is not empty");
  Node node;
  node.kind = Kind::quantity;
  node.quantity = quantity;
  node.minimum = minimum_si;
  node.maximum = maximum_si;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::file() {
  Node node;
  node.kind = Kind::file;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::color(double maximum) {
  Node node;
  node.kind = Kind::color;
  node.item = number(0.0, maximum);
  node.minimum_items = node.maximum_items = 3;
  node.maximum = maximum;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::list(Schema item, std::size_t minimum_items, std::size_t maximum_items) {
  require(minimum_items <= maximum_items, "a range is not empty");
  Node node;
  node.kind = Kind::list;
  node.item = std::move(item);
  node.minimum_items = minimum_items;
  node.maximum_items = maximum_items;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::record(std::vector<Field> fields) {
  return record_or({}, std::move(fields));
}

Schema Schema::record_or(std::string key, std::vector<Field> fields) {
  Node node;
  node.kind = Kind::record;
  node.key = std::move(key);
  std::set<std::string> names;
  node.fields = prepare_all(std::move(fields), names);
  require(node.key.empty() || names.contains(node.key), "the short form stands for one of the fields");
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::map(Schema item) {
  Node node;
  node.kind = Kind::map;
  node.item = std::move(item);
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::map_of_checked_names(Schema item) {
  Node node;
  node.kind = Kind::map;
  node.item = std::move(item);
  node.keys_are_checked = true;
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::choice(std::string key, std::vector<std::pair<std::string, Schema>> alternatives) {
  require(!alternatives.empty(), "a choice has alternatives");
  for (const auto& [word, schema] : alternatives) {
    require(schema.node().kind == Kind::record && schema.node().exclusive.empty(),
            "the alternatives of a choice are records");
    require(schema.node().field(key) == nullptr, "the key of a choice is no field of its alternatives");
  }
  Node node;
  node.kind = Kind::choice;
  node.key = std::move(key);
  node.alternatives = std::move(alternatives);
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::exactly_one(std::vector<Field> alternatives, std::vector<Field> common) {
  require(!alternatives.empty(), "there is something to choose from");
  Node node;
  node.kind = Kind::record;
  std::set<std::string> names;
  for (Field& field : alternatives) {
    field.required = false;
    field.default_yaml.reset();
  }
  node.exclusive = prepare_all(std::move(alternatives), names);
  node.fields = prepare_all(std::move(common), names);
  return Schema(std::make_shared<const Node>(std::move(node)));
}

Schema Schema::exactly_one(std::vector<Field> alternatives) {
  return exactly_one(std::move(alternatives), {});
}

Schema Schema::any() {
  return Schema(std::make_shared<const Node>());
}

Field Field::needed(std::string name, Schema schema, std::string about) {
  return {std::move(name), std::move(schema), std::nullopt, true, std::move(about)};
}

Field Field::with_default(std::string name, Schema schema, std::string default_yaml, std::string about) {
  return {std::move(name), std::move(schema), std::move(default_yaml), false, std::move(about)};
}

Field Field::optional(std::string name, Schema schema, std::string about) {
  return {std::move(name), std::move(schema), std::nullopt, false, std::move(about)};
}

Field Field::renamed_from(std::string earlier_name) const {
  Field field = *this;
  field.old_name = std::move(earlier_name);
  return field;
}

const Schema* Schema::Node::field(const std::string& name) const {
  for (const auto* list : {&fields, &exclusive}) {
    for (const SchemaField& known : *list) {
      if (known.field.name == name) return &known.field.schema;
    }
  }
  return nullptr;
}

std::vector<std::string> Schema::Node::field_names() const {
  std::vector<std::string> names = names_of(exclusive);
  for (std::string& name : names_of(fields))
    names.push_back(std::move(name));
  return names;
}

std::string Schema::Node::new_name_of(const std::string& name) const {
  if (name.empty()) return {};
  for (const auto* list : {&fields, &exclusive}) {
    for (const SchemaField& known : *list) {
      if (known.field.old_name == name) return known.field.name;
    }
  }
  return {};
}

std::vector<std::string> Schema::Node::exclusive_names() const {
  return names_of(exclusive);
}

std::vector<std::string> Schema::Node::alternative_names() const {
  std::vector<std::string> names;
  names.reserve(alternatives.size());
  for (const auto& [word, schema] : alternatives)
    names.push_back(word);
  return names;
}

const Schema* Schema::Node::alternative(const std::string& word) const {
  for (const auto& [known, schema] : alternatives) {
    if (known == word) return &schema;
  }
  return nullptr;
}

std::string expectation_of(const Schema::Node& schema) {
  switch (schema.kind) {
    case Kind::text:
      if (!schema.words.empty()) {
        std::string list = "one of: ";
        for (const std::string& word : schema.words)
          list += (&word == schema.words.data() ? "" : ", ") + word;
        return list;
      }
      if (schema.text_rule == TextRule::name) return "a name";
      return schema.text_rule == TextRule::signal ? "a signal's name" : "text";
    case Kind::boolean:
      return "true or false";
    case Kind::integer:
      return "a whole number";
    case Kind::number:
      return "a number";
    case Kind::quantity:
      return std::string(name_with_article(schema.quantity)) + " with its unit (" +
             unit_list(schema.quantity) + ")";
    case Kind::file:
      return "a file's path";
    case Kind::color:
      return "a colour ([r, g, b], linear from 0 to " + format_number(schema.maximum) +
             ", or '#rrggbb' in quotes, sRGB)";
    case Kind::list:
      return "a list";
    case Kind::record:
      return schema.key.empty() ? "keys and values" : "keys and values, or '" + schema.key + "' alone";
    case Kind::map:
    case Kind::choice:
      return "keys and values";
    case Kind::any:
      return "anything";
  }
  stop_on_misuse("a kind of the list");
}

std::string range_of(const Schema::Node& schema) {
  switch (schema.kind) {
    case Kind::integer: {
      using Limits = std::numeric_limits<std::int64_t>;
      return range_text(
          schema.minimum_integer == Limits::min() ? "" : std::to_string(schema.minimum_integer),
          schema.maximum_integer == Limits::max() ? "" : std::to_string(schema.maximum_integer));
    }
    case Kind::number:
      return range_text(bound(schema.minimum), bound(schema.maximum));
    case Kind::quantity:
      return range_text(bound(schema.minimum, schema.quantity), bound(schema.maximum, schema.quantity));
    default:
      return {};
  }
}

}  // namespace hil::config
