#include "runtime/config/include.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "runtime/config/overrides.hpp"

namespace hil::config {
namespace {

namespace fs = std::filesystem;
using NodeShape = TreeNode::Shape;

/// "plant.yaml:3"
std::string line_of(const TreeNode& node) {
  const Place place = node.place();
  return place.file + ":" + std::to_string(place.line);
}

/// Takes the value of a key out of a mapping.
std::optional<TreeNode> take(TreeNode& mapping, const std::string& key) {
  const auto found =
      std::ranges::find_if(mapping.entries, [&](const TreeEntry& entry) { return entry.key.scalar == key; });
  if (found == mapping.entries.end()) return std::nullopt;
  TreeNode value = std::move(found->value);
  mapping.entries.erase(found);
  return value;
}

class Including {
 public:
  Including(const Schema& schema, TypesWithPlugins& types, Diagnostics& diagnostics)
      : schema_(schema), types_(types), diagnostics_(diagnostics) {}

  std::optional<TreeNode> build(const std::string& path, const std::shared_ptr<const SourceText>& source) {
    std::error_code error;
    fs::path identity = fs::weakly_canonical(path, error);
    included_.emplace(error ? path : identity.string(), source->name());
    std::optional<TreeNode> tree = build_tree(source, diagnostics_);
    if (!tree || tree->shape != NodeShape::mapping) return tree;
    const std::optional<TreeNode> files = take(*tree, "include");
    const std::optional<TreeNode> settings = take(*tree, "set");
    const std::optional<TreeNode> additions = take(*tree, "add");
    const std::size_t before = diagnostics_.count();
    if (files) include(*files, *tree);
    // Without a file the rest has mistakes that are none.
    if (diagnostics_.count() != before) return std::nullopt;
    types_.add_plugins(*tree, diagnostics_);
    if (additions) apply_settings(*tree, schema_, *additions, SettingsKey::add, types_.types, diagnostics_);
    if (settings) apply_settings(*tree, schema_, *settings, SettingsKey::set, types_.types, diagnostics_);
    return tree;
  }

 private:
  void include(const TreeNode& files, TreeNode& tree) {
    if (files.shape == NodeShape::scalar) {
      include({&files}, tree);
      return;
    }
    std::vector<const TreeNode*> all;
    for (const TreeNode& file : files.items) {
      if (file.shape == NodeShape::scalar)
        all.push_back(&file);
      else
        diagnostics_.add(file.place(), "'include': expected the name of a file");
    }
    if (files.shape != NodeShape::sequence)
      diagnostics_.add(files.place(), "'include': expected a list of files");
    include(all, tree);
  }

  void include(const std::vector<const TreeNode*>& files, TreeNode& tree) {
    TreeNode all;
    all.shape = NodeShape::mapping;
    all.source = tree.source;
    all.position = tree.position;
    for (const TreeNode* file : files) {
      std::optional<TreeNode> included = read(*file);
      if (included) join(all, std::move(*included), &tree);
    }
    replace(all, std::move(tree));
    tree = std::move(all);
  }

  std::optional<TreeNode> read(const TreeNode& file) {
    const fs::path path = (fs::path(file.source->directory()) / file.scalar).lexically_normal();
    std::error_code error;
    if (!fs::is_regular_file(path, error)) {
      diagnostics_.add(file.place(), "'include': there is no file " + in_quotes(path.string()));
      return std::nullopt;
    }
    const std::string identity = fs::canonical(path, error).string();
    if (included_.contains(identity)) {
      diagnostics_.add(file.place(), "'include': " + in_quotes(file.scalar) +
                                         " is part of this scenario already; a file is included once");
      return std::nullopt;
    }
    if (included_.size() > max_included_files) {
      diagnostics_.add(file.place(), "'include': more than " + std::to_string(max_included_files) + " files");
      return std::nullopt;
    }
    const auto source = read_source(path.string(), diagnostics_);
    if (!source) return std::nullopt;
    std::optional<TreeNode> tree = build(path.string(), source);
    if (!tree || tree->shape == NodeShape::mapping) return tree;
    diagnostics_.add(file.place(), "'include': " + in_quotes(file.scalar) + " has no keys of a scenario");
    return std::nullopt;
  }

  /// Adds a further included file. `overriding`: the including file's value of the same place, or null.
  void join(TreeNode& all, TreeNode&& more, const TreeNode* overriding) {
    if (all.shape == NodeShape::mapping && more.shape == NodeShape::mapping) {
      for (TreeEntry& entry : more.entries) {
        TreeNode* const there = all.find(entry.key.scalar);
        const bool is_overridden = overriding != nullptr && overriding->shape == NodeShape::mapping;
        if (there == nullptr)
          all.entries.push_back(std::move(entry));
        else
          join(*there, std::move(entry.value), is_overridden ? overriding->find(entry.key.scalar) : nullptr);
      }
    } else if (all.shape == NodeShape::sequence && more.shape == NodeShape::sequence) {
      for (TreeNode& item : more.items)
        all.items.push_back(std::move(item));
    } else if (overriding == nullptr && (all.shape != more.shape || all.scalar != more.scalar)) {
      diagnostics_.add(more.place(), "this differs from " + line_of(all) +
                                         "; write the value that counts into the including file");
    }
  }

  /// Joins the including file's part, whose values count.
  static void replace(TreeNode& all, TreeNode&& own) {
    if (all.shape == NodeShape::mapping && own.shape == NodeShape::mapping) {
      for (TreeEntry& entry : own.entries) {
        TreeNode* const there = all.find(entry.key.scalar);
        if (there == nullptr)
          all.entries.push_back(std::move(entry));
        else
          replace(*there, std::move(entry.value));
      }
    } else if (all.shape == NodeShape::sequence && own.shape == NodeShape::sequence) {
      for (TreeNode& item : own.items)
        all.items.push_back(std::move(item));
    } else if (own.shape != NodeShape::nothing) {
      all = std::move(own);
    }
  }

  const Schema& schema_;
  TypesWithPlugins& types_;
  Diagnostics& diagnostics_;
  std::map<std::string, std::string> included_;  ///< names by their canonical paths
};

}  // namespace

std::optional<TreeNode> build_tree_with_includes(const std::string& path,
                                                 const std::shared_ptr<const SourceText>& source,
                                                 const Schema& schema, TypesWithPlugins& types,
                                                 Diagnostics& diagnostics) {
  return Including(schema, types, diagnostics).build(path, source);
}

}  // namespace hil::config
