#include "runtime/config/overrides.hpp"

#include <algorithm>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <hil/numbers.hpp>

#include "runtime/contract/schema_node.hpp"
#include "runtime/contract/source_text.hpp"

namespace hil::config {
namespace {

using NodeShape = TreeNode::Shape;

/// A word of a path.
struct PathPart {
  std::string word;
  std::size_t offset = 0;  ///< in the source
};

/// `offset`: of the path in its source.
std::vector<PathPart> split(const std::string& path, std::size_t offset) {
  std::vector<PathPart> parts;
  std::size_t begin = 0;
  while (true) {
    const std::size_t dot = std::min(path.find('.', begin), path.size());
    parts.push_back({path.substr(begin, dot - begin), offset + begin});
    if (dot == path.size()) return parts;
    begin = dot + 1;
  }
}

/// The keys under which entries of lists have their names.
std::vector<std::string> name_keys_of(std::span<const BusSectionType> buses) {
  std::vector<std::string> keys{"name", "module", "message"};
  for (const BusSectionType& type : buses) {
    if (std::find(keys.begin(), keys.end(), type.name_key) == keys.end()) keys.push_back(type.name_key);
  }
  return keys;
}

/// The names by which an override finds an entry of a list.
std::vector<std::string> words_of(const TreeNode& item, const std::vector<std::string>& name_keys) {
  if (item.shape == NodeShape::scalar) return {item.scalar};
  std::vector<std::string> words;
  for (const std::string& key : name_keys) {
    const TreeNode* const value = item.find(key);
    if (value != nullptr && value->shape == NodeShape::scalar) words.push_back(value->scalar);
  }
  return words;
}

/// One path with its value: walks its path down the tree and sets the value.
class Override {
 public:
  Override(std::shared_ptr<const SourceText> source, std::vector<PathPart> parts, bool may_add,
           const ScenarioTypes& types, Diagnostics& diagnostics)
      : source_(std::move(source)),
        parts_(std::move(parts)),
        may_add_(may_add),
        types_(types),
        name_keys_(name_keys_of(types.buses)),
        diagnostics_(diagnostics) {}

  void apply(TreeNode& root, const Schema& schema, TreeNode value) {
    TreeNode* target = &root;
    const Schema* below = &schema;
    for (std::size_t i = 0; i < parts_.size() && target != nullptr; ++i)
      target = descend(*target, below, i);
    if (target != nullptr) *target = std::move(value);
  }

 private:
  std::string prefix(std::size_t part) const {
    std::string path;
    for (std::size_t i = 0; i < part; ++i)
      path += parts_[i].word + ".";
    return path;
  }

  TreeNode* refuse(std::size_t part, const std::string& message) {
    diagnostics_.add(source_->place(source_->position(parts_[part].offset)), message);
    return nullptr;
  }

  TreeNode* refuse_unknown(std::size_t part, const std::vector<std::string>& known) {
    const std::string path = prefix(part);
    const std::string near = nearest(parts_[part].word, known);
    return refuse(part, "there is no " + in_quotes(path + parts_[part].word) +
                            (near.empty() ? suggestion(parts_[part].word, known)
                                          : "; did you mean " + in_quotes(path + near) + "?"));
  }

  TreeNode* refuse_new_name(std::size_t part, const std::vector<std::string>& known) {
    const std::string path = prefix(part);
    const std::string near = nearest(parts_[part].word, known);
    return refuse(
        part, "there is no " + in_quotes(path + parts_[part].word) +
                  (near.empty() ? suggestion(parts_[part].word, known) + "; '--add' or 'add' adds a new name"
                                : "; did you mean " + in_quotes(path + near) + "?"));
  }

  TreeNode* refuse_renamed(std::size_t part, const std::string& new_name) {
    const std::string path = prefix(part);
    return refuse(part, "there is no " + in_quotes(path + parts_[part].word) + "; it was renamed to " +
                            in_quotes(path + new_name));
  }

  /// Refuses the part below the list at part `list`, which the file does not have.
  TreeNode* refuse_missing_list(std::size_t list) {
    const std::string& entry = parts_[list + 1].word;
    const std::string path = prefix(list) + parts_[list].word;
    const auto type = std::find_if(
        types_.buses.begin(), types_.buses.end(),
        [&](const BusSectionType& known) { return list == 0 && known.key == parts_[list].word; });
    const std::string missing =
        type != types_.buses.end() ? type->noun + " " + in_quotes(entry) : in_quotes(path + "." + entry);
    return refuse(list + 1, "there is no " + missing + ", since the file has no list " + in_quotes(path));
  }

  TreeNode make(NodeShape shape, std::size_t part) const {
    TreeNode node;
    node.shape = shape;
    node.source = source_;
    node.position = source_->position(parts_[part].offset);
    return node;
  }

  /// The value under part `part` of `parent`, made where it may be; moves `schema` down with it (null: not
  /// known here).
  TreeNode* descend(TreeNode& parent, const Schema*& schema, std::size_t part) {
    const Schema::Node* const rules = schema != nullptr ? &schema->node() : nullptr;
    if (parent.shape == NodeShape::scalar && rules != nullptr && !rules->key.empty() &&
        rules->kind == Kind::record) {
      write_out(parent, rules->key);
    }
    switch (parent.shape) {
      case NodeShape::sequence:
        return descend_into_list(parent, schema, part);
      case NodeShape::mapping:
        return descend_into_mapping(parent, schema, part);
      case NodeShape::nothing:
      case NodeShape::scalar:
        break;
    }
    const std::string path = prefix(part);
    return refuse(part, in_quotes(path.substr(0, path.empty() ? 0 : path.size() - 1)) +
                            " has no keys, so there is no " + in_quotes(path + parts_[part].word));
  }

  /// Replaces the short form of a record by the record.
  static void write_out(TreeNode& scalar, const std::string& key) {
    TreeNode record;
    record.shape = NodeShape::mapping;
    record.source = scalar.source;
    record.position = scalar.position;
    TreeNode key_node = scalar;
    key_node.scalar = key;
    record.entries.push_back({std::move(key_node), scalar});
    scalar = std::move(record);
  }

  TreeNode* descend_into_list(TreeNode& list, const Schema*& schema, std::size_t part) {
    const std::string& word = parts_[part].word;
    schema = schema != nullptr && schema->node().kind == Kind::list ? &*schema->node().item : nullptr;
    std::vector<std::string> known;
    TreeNode* found = nullptr;
    for (TreeNode& item : list.items) {
      for (std::string& name : words_of(item, name_keys_)) {
        if (name == word) {
          if (found != nullptr && found != &item) {
            return refuse(
                part, "more than one entry is called " + in_quotes(word) + "; name it by its index, from 0");
          }
          found = &item;
        }
        known.push_back(std::move(name));
      }
    }
    if (found != nullptr) return found;
    const ParsedInteger index = read_integer(word);
    if (!index.fault.empty()) return refuse_unknown(part, known);
    if (index.value < 0 || static_cast<std::size_t>(index.value) >= list.items.size()) {
      return refuse(part, "there is no entry " + word + "; the list has " +
                              std::to_string(list.items.size()) + " entries, counted from 0");
    }
    return &list.items[static_cast<std::size_t>(index.value)];
  }

  TreeNode* descend_into_mapping(TreeNode& mapping, const Schema*& schema, std::size_t part) {
    const bool is_last = part + 1 == parts_.size();
    const std::string& word = parts_[part].word;
    std::vector<std::string> known;
    for (const TreeEntry& entry : mapping.entries)
      known.push_back(entry.key.scalar);
    const bool is_written = std::find(known.begin(), known.end(), word) != known.end();
    const Schema::Node* const rules = schema != nullptr ? &schema->node() : nullptr;
    if (rules != nullptr && (rules->kind == Kind::record || rules->kind == Kind::choice)) {
      known = fields_of(mapping, *rules);
      schema = field_of(mapping, *rules, word);
      const std::string new_name = new_name_of(mapping, *rules, word);
      if (schema == nullptr && !new_name.empty()) return refuse_renamed(part, new_name);
      if (std::find(known.begin(), known.end(), word) == known.end()) return refuse_unknown(part, known);
      if (schema != nullptr && schema->node().kind == Kind::any) schema = schema_of_parameters(mapping);
    } else if (rules != nullptr && rules->kind == Kind::map) {
      schema = &*rules->item;
      const bool may_be_new = may_add_ || (is_last && rules->keys_are_checked);
      if (!is_written && !may_be_new) return refuse_new_name(part, known);
    } else {
      schema = nullptr;
    }
    const TreeNode* const written = mapping.find(word);
    const bool is_empty = written == nullptr || written->shape == NodeShape::nothing;
    if (is_empty && !is_last && schema != nullptr && schema->node().kind == Kind::list)
      return refuse_missing_list(part);
    if (!is_written) mapping.entries.push_back({key_node(part), make(NodeShape::mapping, part)});
    TreeNode* const value = mapping.find(word);
    if (value->shape == NodeShape::nothing && !is_last) *value = make(NodeShape::mapping, part);
    return value;
  }

  /// Of a task: by its type. Null: not known.
  const Schema* schema_of_parameters(const TreeNode& task) const {
    const TreeNode* const type = task.find("type");
    if (type == nullptr) return nullptr;
    const auto found = types_.modules.find(type->scalar);
    return found == types_.modules.end() ? nullptr : &found->second;
  }

  TreeNode key_node(std::size_t part) const {
    TreeNode key = make(NodeShape::scalar, part);
    key.scalar = parts_[part].word;
    return key;
  }

  static const Schema::Node* alternative_of(const TreeNode& mapping, const Schema::Node& rules) {
    const TreeNode* const word = mapping.find(rules.key);
    const Schema* const chosen = word != nullptr ? rules.alternative(word->scalar) : nullptr;
    return chosen != nullptr ? &chosen->node() : nullptr;
  }

  static std::vector<std::string> fields_of(const TreeNode& mapping, const Schema::Node& rules) {
    if (rules.kind == Kind::record) return rules.field_names();
    std::vector<std::string> names{rules.key};
    if (const Schema::Node* const alternative = alternative_of(mapping, rules)) {
      for (std::string& name : alternative->field_names())
        names.push_back(std::move(name));
    }
    return names;
  }

  static const Schema* field_of(const TreeNode& mapping, const Schema::Node& rules, const std::string& word) {
    if (rules.kind == Kind::record) return rules.field(word);
    const Schema::Node* const alternative = alternative_of(mapping, rules);
    return alternative != nullptr ? alternative->field(word) : nullptr;
  }

  static std::string new_name_of(const TreeNode& mapping, const Schema::Node& rules,
                                 const std::string& word) {
    const Schema::Node* const fields = rules.kind == Kind::record ? &rules : alternative_of(mapping, rules);
    return fields != nullptr ? fields->new_name_of(word) : "";
  }

  std::shared_ptr<const SourceText> source_;
  std::vector<PathPart> parts_;
  const bool may_add_;
  const ScenarioTypes& types_;
  std::vector<std::string> name_keys_;
  Diagnostics& diagnostics_;
};

void set_value(TreeNode& root, const Schema& schema, const std::string& path, bool may_add,
               const std::shared_ptr<const SourceText>& source, std::size_t offset, TreeNode value,
               const ScenarioTypes& types, Diagnostics& diagnostics) {
  std::vector<PathPart> parts = split(path, offset);
  for (const PathPart& part : parts) {
    if (!part.word.empty()) continue;
    diagnostics.add(source->place(source->position(part.offset)),
                    "a word is missing in the path " + in_quotes(path));
    return;
  }
  Override(source, std::move(parts), may_add, types, diagnostics).apply(root, schema, std::move(value));
}

/// Whether it is the value of --add, which begins with a plus (overrides.hpp).
bool is_addition(const std::string& option) {
  return option.starts_with('+');
}
std::string name_of_option(const std::string& option) {
  return is_addition(option) ? "--add " : "--set ";
}

void apply_override(TreeNode& root, const Schema& schema, const std::string& option,
                    const ScenarioTypes& types, Diagnostics& diagnostics) {
  const bool may_add = is_addition(option);
  const std::size_t begin = may_add ? 1 : 0;
  const std::size_t equals = option.find('=');
  if (equals == std::string::npos) {
    diagnostics.add({name_of_option(option) + option.substr(begin), 1, 1},
                    "expected path=value, as in dut.enabled=false");
    return;
  }
  const std::string path = option.substr(begin, equals - begin);
  const auto source = source_of_text(name_of_option(option) + path, option.substr(begin), diagnostics);
  if (!source) return;
  std::optional<TreeNode> value = build_tree_from(source, path.size() + 1, diagnostics);
  if (value) set_value(root, schema, path, may_add, source, 0, std::move(*value), types, diagnostics);
}

}  // namespace

void apply_overrides(TreeNode& root, const Schema& schema, std::span<const std::string> overrides,
                     const ScenarioTypes& types, Diagnostics& diagnostics) {
  std::map<std::string, std::string> values;
  for (const std::string& option : overrides) {
    const std::size_t equals = std::min(option.find('='), option.size());
    const std::size_t begin = is_addition(option) ? 1 : 0;
    const std::string path = option.substr(begin, equals - std::min(begin, equals));
    const std::string value = option.substr(std::min(equals + 1, option.size()));
    const auto [first, is_new] = values.emplace(path, value);
    if (is_new) {
      apply_override(root, schema, option, types, diagnostics);
    } else {
      diagnostics.add({name_of_option(option) + path, 1, 1},
                      in_quotes(path) + " is given twice: " + in_quotes(first->second) + " and " +
                          in_quotes(value) + "; give it once");
    }
  }
}

void apply_settings(TreeNode& root, const Schema& schema, const TreeNode& settings, SettingsKey settings_key,
                    const ScenarioTypes& types, Diagnostics& diagnostics) {
  const bool may_add = settings_key == SettingsKey::add;
  if (settings.shape != NodeShape::mapping) {
    diagnostics.add(settings.place(), std::string(may_add ? "'add'" : "'set'") +
                                          ": expected paths with values, as {dut.enabled: false}");
    return;
  }
  for (const TreeEntry& entry : settings.entries) {
    const TreeNode& key = entry.key;
    const std::size_t quote = key.was_quoted ? 1 : 0;
    set_value(root, schema, key.scalar, may_add, key.source, key.source->offset(key.position) + quote,
              entry.value, types, diagnostics);
  }
}

}  // namespace hil::config
