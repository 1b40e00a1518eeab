#include "runtime/config/schema_markdown.hpp"

#include "runtime/config/check.hpp"
#include "runtime/contract/schema_node.hpp"

namespace hil::config {
namespace {

std::string article_free(const Schema::Node& schema) {
  std::string text = expectation_of(schema);
  if (text.starts_with("a ")) text.erase(0, 2);
  if (text.starts_with("an ")) text.erase(0, 3);
  return text;
}

std::string size_of(const Schema::Node& list) {
  if (list.minimum_items == list.maximum_items) return std::to_string(list.minimum_items) + " of: ";
  return list.minimum_items > 0 ? "list of at least " + std::to_string(list.minimum_items) + " of: "
                                : "list of: ";
}

std::string kind_of(const Schema::Node& schema) {
  const std::string range = range_of(schema);
  switch (schema.kind) {
    case Kind::list:
      return size_of(schema) + kind_of(schema.item->node());
    case Kind::map:
      return "a name of your own for each: " + kind_of(schema.item->node());
    case Kind::choice:
      return "keys that depend on `" + schema.key + "`";
    case Kind::record:
      if (!schema.exclusive.empty())
        return "exactly one of its first " + std::to_string(schema.exclusive.size()) + " keys";
      return schema.key.empty() ? "keys" : "keys, or `" + schema.key + "` alone";
    default:
      return article_free(schema) + (range.empty() ? "" : ", " + range);
  }
}

void write_parts(const Schema::Node& schema, const std::string& indent, std::string& text);

void write_fields(const std::vector<SchemaField>& fields, const std::string& indent, std::string& text) {
  const std::string deeper = indent + "  ";
  for (const SchemaField& known : fields) {
    const Field& field = known.field;
    text.append(indent).append("- `").append(field.name).append("` (").append(kind_of(field.schema.node()));
    if (field.required) text.append("; needed");
    if (field.default_yaml) text.append("; default `").append(default_of(known).source->text()).append("`");
    text.append("): ").append(field.about).append("\n");
    write_parts(field.schema.node(), deeper, text);
  }
}

void write_parts(const Schema::Node& schema, const std::string& indent, std::string& text) {
  if (schema.item) write_parts(schema.item->node(), indent, text);
  write_fields(schema.exclusive, indent, text);
  write_fields(schema.fields, indent, text);
  const std::string deeper = indent + "  ";
  for (const auto& [word, alternative] : schema.alternatives) {
    text.append(indent).append("- with `").append(schema.key).append(": ").append(word).append("`\n");
    write_parts(alternative.node(), deeper, text);
  }
}

}  // namespace

std::string schema_to_markdown(const Schema& schema) {
  std::string text;
  write_parts(schema.node(), "", text);
  return text;
}

}  // namespace hil::config
