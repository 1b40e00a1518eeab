#pragma once
// What a Value holds. For the files of this folder.

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <hil/schema.hpp>

#include "runtime/contract/tree.hpp"

namespace hil::config {

struct Value::Data {
  Kind kind = Kind::any;
  Place place;
  /// False: something in it was a mistake and is left out. Such values stay inside this folder.
  bool is_whole = true;
  bool is_default = false;
  bool boolean = false;
  std::int64_t integer = 0;
  double number = 0.0;
  std::optional<std::int64_t> nanoseconds;  ///< durations
  std::string text;                         ///< text, file
  std::string chosen;
  std::vector<Value> items;
  std::vector<std::pair<std::string, Value>> entries;
  std::vector<Place> key_places;         ///< one per entry
  std::shared_ptr<const TreeNode> tree;  ///< any; text: to find places inside it
};

}  // namespace hil::config
