#include "runtime/config/parse.hpp"

#include <memory>
#include <utility>

#include "runtime/config/check.hpp"
#include "runtime/config/overrides.hpp"
#include "runtime/contract/source_text.hpp"
#include "runtime/contract/tree.hpp"

namespace hil::config {
namespace {

std::optional<Value> parse_source(const std::shared_ptr<const SourceText>& source, const Schema& schema,
                                  Diagnostics& diagnostics, std::span<const std::string> overrides) {
  const std::size_t mistakes_before = diagnostics.count();
  std::optional<TreeNode> tree = build_tree(source, diagnostics);
  if (!tree) return std::nullopt;
  apply_overrides(*tree, schema, overrides, {}, diagnostics);
  std::optional<Value> value = check_tree(*tree, schema, diagnostics);
  if (diagnostics.count() != mistakes_before) return std::nullopt;
  return value;
}

}  // namespace

std::optional<Value> parse_file(const std::string& path, const Schema& schema, Diagnostics& diagnostics,
                                std::span<const std::string> overrides) {
  const std::shared_ptr<const SourceText> source = read_source(path, diagnostics);
  if (!source) return std::nullopt;
  return parse_source(source, schema, diagnostics, overrides);
}

std::optional<Value> parse_text(const std::string& name, std::string_view text, const Schema& schema,
                                Diagnostics& diagnostics, std::span<const std::string> overrides) {
  const std::shared_ptr<const SourceText> source = source_of_text(name, text, diagnostics);
  if (!source) return std::nullopt;
  return parse_source(source, schema, diagnostics, overrides);
}

std::optional<Value> parse_value(const Value& any_value, const Schema& schema, Diagnostics& diagnostics) {
  const std::size_t mistakes_before = diagnostics.count();
  std::optional<Value> value = check_any(any_value, schema, diagnostics);
  if (diagnostics.count() != mistakes_before) return std::nullopt;
  return value;
}

}  // namespace hil::config
