#include "runtime/contract/tree.hpp"

#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/exceptions.h>
#include <yaml-cpp/parser.h>

#include <algorithm>
#include <sstream>
#include <unordered_map>
#include <utility>

#include <hil/require.hpp>

namespace hil::config {
namespace {

/// Thrown through the YAML library to end a document; its mistake has been added already.
struct Refused {};

struct Weight {
  std::size_t nodes = 0;
  std::size_t bytes = 0;
};

Weight weigh(const TreeNode& node) {
  Weight sum{1, node.scalar.size()};
  const auto add = [&](const TreeNode& part) {
    const Weight weight = weigh(part);
    sum.nodes += weight.nodes;
    sum.bytes += weight.bytes;
  };
  for (const TreeNode& item : node.items)
    add(item);
  for (const TreeEntry& entry : node.entries) {
    add(entry.key);
    add(entry.value);
  }
  return sum;
}

std::size_t depth_of(const TreeNode& node) {
  std::size_t deepest = 0;
  for (const TreeNode& item : node.items)
    deepest = std::max(deepest, depth_of(item));
  for (const TreeEntry& entry : node.entries)
    deepest = std::max(deepest, depth_of(entry.value));
  return deepest + 1;
}

class TreeBuilder final : public YAML::EventHandler {
 public:
  TreeBuilder(std::shared_ptr<const SourceText> source, Diagnostics& diagnostics)
      : source_(std::move(source)), diagnostics_(diagnostics) {}

  std::optional<TreeNode> take_root() { return std::move(root_); }

  void OnDocumentStart(const YAML::Mark& mark) override {
    if (documents_++ == 0) return;
    refuse(position_of(mark), "a second document begins here; a file holds one");
  }
  void OnDocumentEnd() override {}

  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    TreeNode node = make(mark, TreeNode::Shape::nothing);
    // The library marks what follows; the key is where a reader looks for the missing value.
    if (!open_.empty() && open_.back().key) node.position = open_.back().key->position;
    attach(std::move(node), anchor);
  }

  void OnScalar(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                const std::string& value) override {
    refuse_tag(mark, tag);
    TreeNode node = make(mark, TreeNode::Shape::scalar);
    node.was_quoted = tag == "!";
    node.scalar = value;
    node.position = source_->behind_anchor(node.position);
    if (!source_->is_closed(node.position)) refuse(node.position, "this quotation mark is never closed");
    attach(std::move(node), anchor);
  }

  void OnAlias(const YAML::Mark& mark, YAML::anchor_t anchor) override {
    const auto found = anchored_.find(anchor);
    if (found == anchored_.end()) refuse(position_of(mark), "this alias stands inside its own anchor");
    if (open_.size() + depth_of(found->second) > max_tree_depth) refuse_depth(mark);
    TreeNode copy = found->second;
    count(mark, weigh(copy));
    attach(std::move(copy), 0);
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value /*style*/) override {
    open(mark, tag, anchor, TreeNode::Shape::sequence);
  }
  void OnMapStart(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value /*style*/) override {
    open(mark, tag, anchor, TreeNode::Shape::mapping);
  }
  void OnSequenceEnd() override { close(); }
  void OnMapEnd() override { close(); }

 private:
  struct Open {
    TreeNode node;
    YAML::anchor_t anchor = 0;
    std::optional<TreeNode> key;
    bool awaits_value = false;  ///< `key` was refused, but its value still comes
    std::unordered_map<std::string, std::uint32_t> line_of_key;
  };

  static TextPosition position_of(const YAML::Mark& mark) {
    if (mark.is_null()) return {};
    return {static_cast<std::uint32_t>(mark.line), static_cast<std::uint32_t>(mark.column)};
  }

  TreeNode make(const YAML::Mark& mark, TreeNode::Shape shape) const {
    TreeNode node;
    node.shape = shape;
    node.source = source_;
    node.position = position_of(mark);
    return node;
  }

  [[noreturn]] void refuse(TextPosition position, std::string message) {
    diagnostics_.add(source_->place(position), std::move(message));
    throw Refused{};
  }

  [[noreturn]] void refuse_depth(const YAML::Mark& mark) {
    refuse(position_of(mark), "nested deeper than " + std::to_string(max_tree_depth) + " levels");
  }

  void refuse_tag(const YAML::Mark& mark, const std::string& tag) {
    if (tag.empty() || tag == "?" || tag == "!") return;
    diagnostics_.add(source_->place(position_of(mark)),
                     "the tag " + in_quotes(tag) + " is not supported; leave it out");
  }

  void count(const YAML::Mark& mark, const Weight& weight) {
    weight_.nodes += weight.nodes;
    weight_.bytes += weight.bytes;
    if (weight_.nodes > max_tree_nodes) {
      refuse(position_of(mark), "a document has at most " + std::to_string(max_tree_nodes) +
                                    " values, aliases written out; here this one has more");
    }
    if (weight_.bytes > max_tree_bytes) {
      refuse(position_of(mark), "a document has at most " + std::to_string(max_tree_bytes) +
                                    " bytes of values, aliases written out; here this one has more");
    }
  }

  void open(const YAML::Mark& mark, const std::string& tag, YAML::anchor_t anchor, TreeNode::Shape shape) {
    if (open_.size() >= max_tree_depth) refuse_depth(mark);
    refuse_tag(mark, tag);
    open_.push_back({make(mark, shape), anchor, std::nullopt, false, {}});
  }

  void close() {
    Open closed = std::move(open_.back());
    open_.pop_back();
    attach(std::move(closed.node), closed.anchor);
  }

  void attach(TreeNode node, YAML::anchor_t anchor) {
    YAML::Mark mark;
    mark.line = static_cast<int>(node.position.line);
    mark.column = static_cast<int>(node.position.byte);
    count(mark, {1, node.scalar.size()});
    if (anchor != 0) {
      count(mark, weigh(node));
      anchored_.insert_or_assign(anchor, node);
    }
    if (open_.empty()) {
      root_ = std::move(node);
    } else if (open_.back().node.shape == TreeNode::Shape::sequence) {
      open_.back().node.items.push_back(std::move(node));
    } else {
      attach_to_mapping(open_.back(), std::move(node));
    }
    if (diagnostics_.full()) throw Refused{};
  }

  void attach_to_mapping(Open& mapping, TreeNode node) {
    if (mapping.key) {
      mapping.node.entries.push_back({std::move(*mapping.key), std::move(node)});
      mapping.key.reset();
    } else if (mapping.awaits_value) {
      mapping.awaits_value = false;
    } else if (accept_key(mapping, node)) {
      mapping.key = std::move(node);
    } else {
      mapping.awaits_value = true;
    }
  }

  bool accept_key(Open& mapping, const TreeNode& key) {
    if (key.shape != TreeNode::Shape::scalar) {
      diagnostics_.add(key.place(), "a key has to be a word");
      return false;
    }
    if (key.scalar == "<<" && !key.was_quoted) {
      diagnostics_.add(key.place(), "merge keys (<<) are not supported; write the fields out");
      return false;
    }
    const auto [known, is_new] = mapping.line_of_key.try_emplace(key.scalar, key.position.line + 1);
    if (is_new) return true;
    diagnostics_.add(key.place(), "the key " + in_quotes(key.scalar) + " is given twice; first in line " +
                                      std::to_string(known->second));
    return false;
  }

  std::shared_ptr<const SourceText> source_;
  Diagnostics& diagnostics_;
  std::vector<Open> open_;
  std::unordered_map<YAML::anchor_t, TreeNode> anchored_;
  std::optional<TreeNode> root_;
  Weight weight_;
  std::size_t documents_ = 0;
};

std::optional<TreeNode> build(const std::shared_ptr<const SourceText>& source, const std::string& text,
                              Diagnostics& diagnostics) {
  TreeBuilder builder(source, diagnostics);
  try {
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    while (parser.HandleNextDocument(builder)) {
    }
  } catch (const Refused&) {
    return std::nullopt;
  } catch (const YAML::Exception& error) {
    TextPosition position;
    if (!error.mark.is_null()) {
      position = {static_cast<std::uint32_t>(error.mark.line), static_cast<std::uint32_t>(error.mark.column)};
    }
    diagnostics.add(source->place(position), "this is not YAML: " + error.msg);
    return std::nullopt;
  }
  std::optional<TreeNode> root = builder.take_root();
  if (!root || root->shape == TreeNode::Shape::nothing) {
    diagnostics.add(source->place({0, 0}), "the text is empty; a document has keys and values");
    return std::nullopt;
  }
  return root;
}

}  // namespace

const TreeNode* TreeNode::find(const std::string& key) const {
  for (const TreeEntry& entry : entries) {
    if (entry.key.scalar == key) return &entry.value;
  }
  return nullptr;
}

TreeNode* TreeNode::find(const std::string& key) {
  return const_cast<TreeNode*>(
      std::as_const(*this).find(key));  // this node is not const, so neither is its part
}

std::optional<TreeNode> build_tree(const std::shared_ptr<const SourceText>& source,
                                   Diagnostics& diagnostics) {
  if (!check_source(*source, diagnostics)) return std::nullopt;
  const std::string& text = source->text();
  return build(source, text, diagnostics);
}

std::optional<TreeNode> build_tree_from(const std::shared_ptr<const SourceText>& source, std::size_t begin,
                                        Diagnostics& diagnostics) {
  require(begin <= source->text().size(), "the text begins inside its source");
  if (!check_source(*source, diagnostics)) return std::nullopt;
  // Blanks in front keep the columns what they are.
  const std::string text = std::string(begin, ' ') + source->text().substr(begin);
  return build(source, text, diagnostics);
}

}  // namespace hil::config
