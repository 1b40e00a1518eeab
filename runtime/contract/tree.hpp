#pragma once
// A YAML document as a tree in which each part has its place. Nothing is interpreted here: a scalar is its
// text, and the schema decides what it means ("no" is never a boolean, "010" is never eight).
//
// Refused, with the place: tags, merge keys (<<), keys that are not plain words, a second document, an anchor
// that contains itself, and a document above one of the limits below. Anchors and aliases are allowed; an
// alias is a copy whose parts have the places of the anchor's.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <hil/diagnostics.hpp>

#include "runtime/contract/source_text.hpp"

namespace hil::config {

inline constexpr std::size_t max_tree_depth = 64;
inline constexpr std::size_t max_tree_nodes = 250'000;  ///< aliases written out
inline constexpr std::size_t max_tree_bytes =
    std::size_t{16} * 1024 * 1024;  ///< of scalars, aliases written out

struct TreeEntry;

struct TreeNode {
  enum class Shape : std::uint8_t { nothing, scalar, sequence, mapping };

  Shape shape = Shape::nothing;
  bool was_quoted = false;  ///< a scalar that was written in quotes or as a block
  std::string scalar;
  std::vector<TreeNode> items;     ///< sequence
  std::vector<TreeEntry> entries;  ///< mapping, in the order of the file, keys distinct
  std::shared_ptr<const SourceText> source;
  TextPosition position;

  Place place() const { return source->place(position); }
  const TreeNode* find(const std::string& key) const;
  TreeNode* find(const std::string& key);
};

struct TreeEntry {
  TreeNode key;  ///< a scalar
  TreeNode value;
};

/// The document in `source`. Empty with at least one mistake when it is not YAML or is refused; mistakes that
/// leave a tree worth checking (a duplicate key, of which the first counts) are added as well.
std::optional<TreeNode> build_tree(const std::shared_ptr<const SourceText>& source, Diagnostics& diagnostics);

/// The same for the text from `begin` of the first line of `source` to its end.
std::optional<TreeNode> build_tree_from(const std::shared_ptr<const SourceText>& source, std::size_t begin,
                                        Diagnostics& diagnostics);

}  // namespace hil::config
