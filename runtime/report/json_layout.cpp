#include "runtime/report/json_layout.hpp"

#include <algorithm>

#include "runtime/report/text_safety.hpp"

namespace hil::report {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t line_width = 120;
constexpr std::size_t indent_step = 2;

std::string on_one_line(const Json& value) {
  return value.dump();
}

bool is_plain(const Json& value) {
  return !value.is_structured() || value.empty();
}

/// A short list without lists or objects in it, such as [1.0, 2.0, 3].
bool is_row(const Json& value) {
  return value.is_array() && std::ranges::all_of(value, is_plain);
}

void lay_out(std::string& out, const Json& value, std::size_t indent);

/// As many entries per line as fit.
void lay_out_wrapped(std::string& out, const Json& list, std::size_t indent) {
  std::string whole = on_one_line(list);
  if (indent + whole.size() <= line_width) {
    out += whole;
    return;
  }
  const std::string margin(indent + indent_step, ' ');
  out += "[";
  std::size_t column = line_width;
  bool first = true;
  for (const Json& item : list) {
    const std::string text = on_one_line(item);
    if (!first) out += ',';
    if (column + text.size() + 1 > line_width) {
      out += '\n' + margin;
      column = margin.size();
    }
    out += text;
    column += text.size() + 1;
    first = false;
  }
  out += '\n' + std::string(indent, ' ') + ']';
}

void lay_out_entries(std::string& out, const Json& value, std::size_t indent) {
  const bool object = value.is_object();
  const std::string margin(indent + indent_step, ' ');
  out += object ? "{" : "[";
  bool first = true;
  for (auto entry = value.begin(); entry != value.end(); ++entry) {
    out += first ? "\n" : ",\n";
    out += margin;
    if (object) out += json_quoted(entry.key()) + ": ";
    lay_out(out, *entry, indent + indent_step);
    first = false;
  }
  out += '\n' + std::string(indent, ' ') + (object ? '}' : ']');
}

void lay_out(std::string& out, const Json& value, std::size_t indent) {
  const bool rows =
      value.is_array() && std::ranges::all_of(value, [](const Json& item) { return is_row(item); });
  if (is_plain(value)) {
    out += on_one_line(value);
  } else if (is_row(value) || rows) {
    lay_out_wrapped(out, value, indent);
  } else {
    lay_out_entries(out, value, indent);
  }
}

}  // namespace

std::string readable_json(const Json& value) {
  std::string out;
  lay_out(out, value, 0);
  out += '\n';
  return out;
}

std::string json_quoted(const std::string& text) {
  return on_one_line(Json(valid_utf8(text)));
}

}  // namespace hil::report
