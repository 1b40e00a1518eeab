#pragma once
// What a Schema consists of. For the files of this folder.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <hil/schema.hpp>

#include "runtime/contract/tree.hpp"

namespace hil::config {

enum class TextRule : std::uint8_t { free, name, signal };

/// The default of a field, once it was read. Any thread.
struct FieldDefault {
  std::once_flag is_read;
  std::optional<TreeNode> tree;
};

struct SchemaField {
  Field field;
  std::shared_ptr<FieldDefault> read_default = std::make_shared<FieldDefault>();
};

struct Schema::Node {
  Kind kind = Kind::any;
  TextRule text_rule = TextRule::free;
  std::vector<std::string> words;  ///< text: the closed list; empty: free
  std::int64_t minimum_integer = 0;
  std::int64_t maximum_integer = 0;
  double minimum = -std::numeric_limits<double>::infinity();
  double maximum = std::numeric_limits<double>::infinity();
  Quantity quantity = Quantity::length_m;
  std::size_t minimum_items = 0;
  std::size_t maximum_items = 0;
  std::optional<Schema> item;                                ///< list, map
  bool keys_are_checked = false;                             ///< map: by something else, so --set adds some
  std::vector<SchemaField> fields;                           ///< record; exactly_one: the common ones
  std::vector<SchemaField> exclusive;                        ///< exactly_one: the alternatives
  std::string key;                                           ///< choice, record_or
  std::vector<std::pair<std::string, Schema>> alternatives;  ///< choice

  /// The schema under a field's name, or null.
  const Schema* field(const std::string& name) const;
  std::vector<std::string> field_names() const;
  /// The name of the field with this old name; empty: there is none.
  std::string new_name_of(const std::string& name) const;
  std::vector<std::string> exclusive_names() const;
  std::vector<std::string> alternative_names() const;
  const Schema* alternative(const std::string& word) const;
};

/// "a length", "a whole number", "one of: fifo, other": what the user should have written.
std::string expectation_of(const Schema::Node& schema);

/// "from 1 to 98", "at least 0 m/s", or empty; quantities in their SI unit.
std::string range_of(const Schema::Node& schema);

}  // namespace hil::config
