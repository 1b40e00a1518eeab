#include "runtime/config/check.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>
#include <utility>

#include <hil/numbers.hpp>
#include <hil/quantity.hpp>
#include <hil/require.hpp>

#include "runtime/config/color.hpp"
#include "runtime/contract/schema_node.hpp"
#include "runtime/contract/value_data.hpp"

namespace hil::config {
namespace {

namespace fs = std::filesystem;
using Shape = TreeNode::Shape;
using Data = Value::Data;

bool is_letter(char letter) {
  return (letter >= 'a' && letter <= 'z') || (letter >= 'A' && letter <= 'Z') || letter == '_';
}
bool is_digit(char letter) {
  return letter >= '0' && letter <= '9';
}

std::string found(const TreeNode& tree) {
  switch (tree.shape) {
    case Shape::nothing:
      return "nothing";
    case Shape::scalar:
      return in_quotes(tree.scalar);
    case Shape::sequence:
      return "a list";
    case Shape::mapping:
      return "keys and values";
  }
  stop_on_misuse("a shape of the list");
}

/// Why the file can not be used; empty when it can.
std::string file_fault(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return "there is no such file";
  if (error) return "can not be read: " + error.message();
  if (status.type() == fs::file_type::directory) return "this is a directory, not a file";
  if (status.type() != fs::file_type::regular) return "this is not a regular file";
  errno = 0;
  const std::ifstream stream(path);
  return stream ? "" : std::string("can not be opened: ") + std::strerror(errno);
}

/// One walk through a tree.
class Checker {
 public:
  explicit Checker(Diagnostics& diagnostics) : diagnostics_(diagnostics) {}
  Checker(Diagnostics& diagnostics, Place place_of_defaults)
      : diagnostics_(diagnostics), place_of_defaults_(std::move(place_of_defaults)) {}

  /// `label` names the value in messages: "'rate'", or empty for the whole document.
  std::optional<Value> check(const TreeNode& tree, const Schema::Node& schema, const std::string& label);

 private:
  using Maybe = std::optional<Value>;

  Place place_of(const TreeNode& tree) const {
    return place_of_defaults_ ? *place_of_defaults_ : tree.place();
  }

  std::nullopt_t wrong(const TreeNode& tree, const std::string& label, const std::string& message) {
    diagnostics_.add(place_of(tree), label.empty() ? message : label + ": " + message);
    return std::nullopt;
  }

  Data begin(const TreeNode& tree, Kind kind) const {
    Data data;
    data.kind = kind;
    data.place = place_of(tree);
    data.is_default = place_of_defaults_.has_value();
    return data;
  }

  static Value end(Data data) { return Value(std::make_shared<const Data>(std::move(data))); }

  bool expect_scalar(const TreeNode& tree, const Schema::Node& schema, const std::string& label,
                     bool allows_quotes);
  Maybe check_text(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_boolean(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_integer(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_number(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_quantity(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_file(const TreeNode& tree, const std::string& label);
  Maybe check_color(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_list(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_map(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_record(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_choice(const TreeNode& tree, const Schema::Node& schema, const std::string& label);
  Maybe check_any(const TreeNode& tree, const std::string& label);

  void add_entry(Data& data, const std::string& name, Maybe value, Place key_place) const;
  void check_written_fields(Data& data, const TreeNode& tree, const Schema::Node& schema,
                            const std::string& own_key);
  void add_missing_fields(Data& data, const TreeNode& tree, const Schema::Node& schema);
  void check_exclusive_fields(Data& data, const TreeNode& tree, const Schema::Node& schema);

  Diagnostics& diagnostics_;
  std::optional<Place> place_of_defaults_;
};

std::optional<Value> Checker::check(const TreeNode& tree, const Schema::Node& schema,
                                    const std::string& label) {
  if (diagnostics_.full()) return std::nullopt;
  switch (schema.kind) {
    case Kind::text:
      return check_text(tree, schema, label);
    case Kind::boolean:
      return check_boolean(tree, schema, label);
    case Kind::integer:
      return check_integer(tree, schema, label);
    case Kind::number:
      return check_number(tree, schema, label);
    case Kind::quantity:
      return check_quantity(tree, schema, label);
    case Kind::file:
      return check_file(tree, label);
    case Kind::color:
      return check_color(tree, schema, label);
    case Kind::list:
      return check_list(tree, schema, label);
    case Kind::record:
      return check_record(tree, schema, label);
    case Kind::map:
      return check_map(tree, schema, label);
    case Kind::choice:
      return check_choice(tree, schema, label);
    case Kind::any:
      return check_any(tree, label);
  }
  stop_on_misuse("a kind of the list");
}

bool Checker::expect_scalar(const TreeNode& tree, const Schema::Node& schema, const std::string& label,
                            bool allows_quotes) {
  if (tree.shape != Shape::scalar) {
    wrong(tree, label, "expected " + expectation_of(schema) + ", found " + found(tree));
    return false;
  }
  if (tree.was_quoted && !allows_quotes) {
    wrong(tree, label,
          "expected " + expectation_of(schema) + ", found the text " + in_quotes(tree.scalar) +
              "; write it without quotes");
    return false;
  }
  return true;
}

std::optional<Value> Checker::check_text(const TreeNode& tree, const Schema::Node& schema,
                                         const std::string& label) {
  if (!expect_scalar(tree, schema, label, true)) return std::nullopt;
  const std::string& text = tree.scalar;
  if (text.empty()) return wrong(tree, label, "expected " + expectation_of(schema) + ", found an empty text");
  if (!schema.words.empty()) {
    bool known = false;
    for (const std::string& word : schema.words)
      known = known || word == text;
    if (!known) {
      const std::string near = nearest(text, schema.words);
      return wrong(tree, label,
                   in_quotes(text) + " is not " + expectation_of(schema) +
                       (near.empty() ? "" : "; did you mean " + in_quotes(near) + "?"));
    }
  }
  if (schema.text_rule == TextRule::name && !is_name(text)) {
    return wrong(
        tree, label,
        in_quotes(text) + " is not a name; a name has letters, digits and _ and begins with no digit");
  }
  const bool is_call = text.ends_with(')');  // a relation; KnownSignals::find checks it
  if (schema.text_rule == TextRule::signal && !is_call && !is_signal_name(text)) {
    return wrong(tree, label, in_quotes(text) + " is not a signal's name; that is names joined by dots");
  }
  Data data = begin(tree, Kind::text);
  data.text = text;
  data.tree = std::make_shared<const TreeNode>(tree);
  return end(std::move(data));
}

std::optional<Value> Checker::check_boolean(const TreeNode& tree, const Schema::Node& schema,
                                            const std::string& label) {
  if (!expect_scalar(tree, schema, label, false)) return std::nullopt;
  if (tree.scalar != "true" && tree.scalar != "false") {
    return wrong(
        tree, label,
        in_quotes(tree.scalar) + " is not a boolean; write true or false (yes, no, on and off are none)");
  }
  Data data = begin(tree, Kind::boolean);
  data.boolean = tree.scalar == "true";
  return end(std::move(data));
}

std::optional<Value> Checker::check_integer(const TreeNode& tree, const Schema::Node& schema,
                                            const std::string& label) {
  if (!expect_scalar(tree, schema, label, false)) return std::nullopt;
  const ParsedInteger reading = read_integer(tree.scalar);
  if (!reading.fault.empty()) return wrong(tree, label, in_quotes(tree.scalar) + " " + reading.fault);
  if (reading.value < schema.minimum_integer || reading.value > schema.maximum_integer) {
    return wrong(tree, label, tree.scalar + " is out of range; it can be " + range_of(schema));
  }
  Data data = begin(tree, Kind::integer);
  data.integer = reading.value;
  return end(std::move(data));
}

std::optional<Value> Checker::check_number(const TreeNode& tree, const Schema::Node& schema,
                                           const std::string& label) {
  if (!expect_scalar(tree, schema, label, false)) return std::nullopt;
  const ParsedNumber reading = read_number(tree.scalar);
  if (!reading.fault.empty()) return wrong(tree, label, in_quotes(tree.scalar) + " " + reading.fault);
  if (reading.length != tree.scalar.size()) {
    return wrong(tree, label,
                 in_quotes(tree.scalar) + " is not a number: what is " +
                     in_quotes(tree.scalar.substr(reading.length)) + "? This value has no unit");
  }
  if (reading.value < schema.minimum || reading.value > schema.maximum) {
    return wrong(tree, label, tree.scalar + " is out of range; it can be " + range_of(schema));
  }
  Data data = begin(tree, Kind::number);
  data.number = reading.value;
  return end(std::move(data));
}

std::optional<Value> Checker::check_quantity(const TreeNode& tree, const Schema::Node& schema,
                                             const std::string& label) {
  if (!expect_scalar(tree, schema, label, true)) return std::nullopt;
  const QuantityReading reading = read_quantity(tree.scalar, schema.quantity);
  if (!reading.fault.empty()) return wrong(tree, label, in_quotes(tree.scalar) + " " + reading.fault);
  if (reading.value_si < schema.minimum || reading.value_si > schema.maximum) {
    const bool has_minimum = schema.minimum > -std::numeric_limits<double>::infinity();
    const bool has_maximum = schema.maximum < std::numeric_limits<double>::infinity();
    const std::string least = format_limit(schema.minimum, schema.quantity, *reading.unit);
    const std::string most = format_limit(schema.maximum, schema.quantity, *reading.unit);
    return wrong(tree, label,
                 in_quotes(tree.scalar) + " is out of range; it can be " +
                     (!has_minimum   ? "at most " + most
                      : !has_maximum ? "at least " + least
                                     : "from " + least + " to " + most));
  }
  Data data = begin(tree, Kind::quantity);
  data.number = reading.value_si;
  if (schema.quantity == Quantity::duration_s) data.nanoseconds = reading.nanoseconds;
  return end(std::move(data));
}

std::optional<Value> Checker::check_file(const TreeNode& tree, const std::string& label) {
  if (tree.shape != Shape::scalar || tree.scalar.empty()) {
    return wrong(tree, label, "expected a file's path, found " + found(tree));
  }
  const fs::path path = (fs::path(tree.source->directory()) / tree.scalar).lexically_normal();
  const std::string fault = file_fault(path);
  if (!fault.empty())
    return wrong(tree, label, in_quotes(tree.scalar) + ": " + fault + " (" + path.string() + ")");
  Data data = begin(tree, Kind::file);
  data.text = path.string();
  return end(std::move(data));
}

std::optional<Value> Checker::check_color(const TreeNode& tree, const Schema::Node& schema,
                                          const std::string& label) {
  if (tree.shape == Shape::sequence) return check_list(tree, schema, label);
  const auto channels = tree.shape == Shape::scalar ? read_srgb_color(tree.scalar) : std::nullopt;
  if (!channels) return wrong(tree, label, "expected " + expectation_of(schema) + ", found " + found(tree));
  Data data = begin(tree, Kind::list);
  for (const double channel : *channels) {
    Data number = begin(tree, Kind::number);
    number.number = channel;
    data.items.push_back(end(std::move(number)));
  }
  return end(std::move(data));
}

std::optional<Value> Checker::check_list(const TreeNode& tree, const Schema::Node& schema,
                                         const std::string& label) {
  if (tree.shape != Shape::sequence) return wrong(tree, label, "expected a list, found " + found(tree));
  Data data = begin(tree, Kind::list);
  const std::size_t count = tree.items.size();
  if (count < schema.minimum_items || count > schema.maximum_items) {
    const std::string wanted =
        schema.minimum_items == schema.maximum_items ? std::to_string(schema.minimum_items)
        : count < schema.minimum_items               ? "at least " + std::to_string(schema.minimum_items)
                                                     : "at most " + std::to_string(schema.maximum_items);
    wrong(tree, label, "a list of " + std::to_string(count) + "; expected " + wanted);
    data.is_whole = false;
  }
  data.items.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::string item_label = "entry " + std::to_string(i) + (label.empty() ? "" : " of " + label);
    Maybe item = check(tree.items[i], schema.item->node(), item_label);
    data.is_whole = data.is_whole && item && is_whole(*item);
    if (item) data.items.push_back(std::move(*item));
  }
  return end(std::move(data));
}

void Checker::add_entry(Data& data, const std::string& name, Maybe value, Place key_place) const {
  data.is_whole = data.is_whole && value && is_whole(*value);
  if (!value) return;
  data.entries.emplace_back(name, std::move(*value));
  data.key_places.push_back(std::move(key_place));
}

std::optional<Value> Checker::check_map(const TreeNode& tree, const Schema::Node& schema,
                                        const std::string& label) {
  if (tree.shape != Shape::mapping)
    return wrong(tree, label, "expected keys and values, found " + found(tree));
  Data data = begin(tree, Kind::map);
  for (const TreeEntry& entry : tree.entries) {
    if (!is_name(entry.key.scalar)) {
      wrong(entry.key, label,
            "the key " + in_quotes(entry.key.scalar) +
                " is not a name; a name has letters, digits and _ and begins with no digit");
      data.is_whole = false;
      continue;
    }
    add_entry(data, entry.key.scalar, check(entry.value, schema.item->node(), in_quotes(entry.key.scalar)),
              place_of(entry.key));
  }
  return end(std::move(data));
}

void Checker::check_written_fields(Data& data, const TreeNode& tree, const Schema::Node& schema,
                                   const std::string& own_key) {
  for (const TreeEntry& entry : tree.entries) {
    const std::string& name = entry.key.scalar;
    if (!own_key.empty() && name == own_key) continue;
    if (const Schema* const field = schema.field(name)) {
      add_entry(data, name, check(entry.value, field->node(), in_quotes(name)), place_of(entry.key));
      continue;
    }
    std::vector<std::string> known = schema.field_names();
    if (!own_key.empty()) known.push_back(own_key);
    const std::string new_name = schema.new_name_of(name);
    diagnostics_.add(
        place_of(entry.key),
        "unknown key " + in_quotes(name) +
            (new_name.empty() ? suggestion(name, known) : "; it was renamed to " + in_quotes(new_name)));
    if (diagnostics_.full()) return;
  }
}

void Checker::add_missing_fields(Data& data, const TreeNode& tree, const Schema::Node& schema) {
  for (const SchemaField& known : schema.fields) {
    const Field& field = known.field;
    if (tree.find(field.name) != nullptr) continue;
    if (field.required) {
      diagnostics_.add(place_of(tree), "missing key " + in_quotes(field.name) + " (" + field.about + ")");
      data.is_whole = false;
    } else if (field.default_yaml) {
      Checker of_default(diagnostics_, data.place);
      add_entry(data, field.name,
                of_default.check(default_of(known), field.schema.node(), in_quotes(field.name)), data.place);
    }
  }
}

void Checker::check_exclusive_fields(Data& data, const TreeNode& tree, const Schema::Node& schema) {
  std::string names;
  for (const std::string& name : schema.exclusive_names())
    names += (names.empty() ? "" : ", ") + name;
  for (const TreeEntry& entry : tree.entries) {
    bool is_exclusive = false;
    for (const SchemaField& known : schema.exclusive) {
      is_exclusive = is_exclusive || known.field.name == entry.key.scalar;
    }
    if (!is_exclusive) continue;
    if (data.chosen.empty()) {
      data.chosen = entry.key.scalar;
      continue;
    }
    diagnostics_.add(place_of(entry.key), in_quotes(entry.key.scalar) + " next to " + in_quotes(data.chosen) +
                                              "; there can be exactly one of: " + names);
    data.is_whole = false;
  }
  if (!data.chosen.empty()) return;
  data.is_whole = false;
  const bool has_unknown = std::ranges::any_of(  // perhaps the key that is needed, which is reported
      tree.entries, [&](const TreeEntry& entry) { return schema.field(entry.key.scalar) == nullptr; });
  if (!has_unknown) diagnostics_.add(place_of(tree), "exactly one of these keys is needed: " + names);
}

std::optional<Value> Checker::check_record(const TreeNode& tree, const Schema::Node& schema,
                                           const std::string& label) {
  if (tree.shape == Shape::scalar && !schema.key.empty()) {
    TreeNode written_out;
    written_out.shape = Shape::mapping;
    written_out.source = tree.source;
    written_out.position = tree.position;
    TreeNode key = tree;
    key.scalar = schema.key;
    written_out.entries.push_back({std::move(key), tree});
    return check_record(written_out, schema, label);
  }
  if (tree.shape != Shape::mapping) {
    return wrong(tree, label, "expected " + expectation_of(schema) + ", found " + found(tree));
  }
  Data data = begin(tree, Kind::record);
  check_written_fields(data, tree, schema, {});
  add_missing_fields(data, tree, schema);
  if (!schema.exclusive.empty()) check_exclusive_fields(data, tree, schema);
  return end(std::move(data));
}

std::optional<Value> Checker::check_choice(const TreeNode& tree, const Schema::Node& schema,
                                           const std::string& label) {
  if (tree.shape != Shape::mapping)
    return wrong(tree, label, "expected keys and values, found " + found(tree));
  const TreeNode* const word = tree.find(schema.key);
  const std::vector<std::string> known = schema.alternative_names();
  if (word == nullptr) {
    return wrong(tree, label, "missing key " + in_quotes(schema.key) + suggestion({}, known));
  }
  const Schema* const alternative = word->shape == Shape::scalar ? schema.alternative(word->scalar) : nullptr;
  if (alternative == nullptr) {
    return wrong(*word, in_quotes(schema.key),
                 found(*word) + " is unknown" + suggestion(word->scalar, known));
  }
  Data data = begin(tree, Kind::choice);
  data.chosen = word->scalar;
  Data text = begin(*word, Kind::text);
  text.text = word->scalar;
  text.tree = std::make_shared<const TreeNode>(*word);
  add_entry(data, schema.key, end(std::move(text)), place_of(*word));
  check_written_fields(data, tree, alternative->node(), schema.key);
  add_missing_fields(data, tree, alternative->node());
  return end(std::move(data));
}

std::optional<Value> Checker::check_any(const TreeNode& tree, const std::string& label) {
  if (tree.shape == Shape::nothing) return wrong(tree, label, "has no value; write {} for none");
  Data data = begin(tree, Kind::any);
  data.tree = std::make_shared<const TreeNode>(tree);
  return end(std::move(data));
}

}  // namespace

const TreeNode& default_of(const SchemaField& known) {
  FieldDefault& of = *known.read_default;
  std::call_once(of.is_read, [&] {
    Diagnostics diagnostics;
    const auto source = std::make_shared<const SourceText>("default of " + known.field.name, "",
                                                           known.field.default_yaml.value_or(""));
    of.tree = build_tree(source, diagnostics);
    if (of.tree) check_tree(*of.tree, known.field.schema, diagnostics);
    require(diagnostics.empty(), diagnostics.to_text().c_str());
  });
  return *of.tree;
}

std::optional<Value> check_tree(const TreeNode& tree, const Schema& schema, Diagnostics& diagnostics) {
  return Checker(diagnostics).check(tree, schema.node(), {});
}

std::optional<Value> check_any(const Value& any_value, const Schema& schema, Diagnostics& diagnostics) {
  const Value::Data& data = any_value.data();
  require(data.kind == Kind::any && data.tree != nullptr, "a second parse of a value of Kind::any");
  if (data.is_default) return Checker(diagnostics, data.place).check(*data.tree, schema.node(), {});
  return Checker(diagnostics).check(*data.tree, schema.node(), {});
}

bool is_whole(const Value& value) {
  return value.data().is_whole;
}

bool is_name(std::string_view word) {
  if (word.empty() || is_digit(word[0])) return false;
  for (const char letter : word) {
    if (!is_letter(letter) && !is_digit(letter)) return false;
  }
  return true;
}

bool is_signal_name(std::string_view word) {
  while (true) {
    const std::size_t dot = word.find('.');
    if (!is_name(word.substr(0, dot))) return false;
    if (dot == std::string_view::npos) return true;
    word.remove_prefix(dot + 1);
  }
}

}  // namespace hil::config
