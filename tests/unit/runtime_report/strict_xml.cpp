#include "strict_xml.hpp"

#include <cctype>
#include <stdexcept>

namespace hil::report::test {
namespace {

bool is_name_character(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_' || c == ':';
}
bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\n' || c == '\r';
}

class Reader {
 public:
  explicit Reader(std::string_view document) : rest_(document), whole_(document) {}

  XmlElement document() {
    skip_prologue("<?xml", "?>");
    skip_prologue("<!DOCTYPE html", ">");
    skip_space();
    XmlElement root = element();
    skip_space();
    if (!rest_.empty()) fail("something after the root");
    return root;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw std::runtime_error(what + " at byte " + std::to_string(whole_.size() - rest_.size()));
  }
  bool take(std::string_view expected) {
    if (!rest_.starts_with(expected)) return false;
    rest_.remove_prefix(expected.size());
    return true;
  }
  void need(std::string_view expected) {
    if (!take(expected)) fail("no '" + std::string(expected) + "'");
  }
  void skip_space() {
    while (!rest_.empty() && is_space(rest_.front()))
      rest_.remove_prefix(1);
  }
  void skip_prologue(std::string_view start, std::string_view end) {
    if (!rest_.starts_with(start)) return;
    const std::size_t at = rest_.find(end);
    if (at == std::string_view::npos) fail("an open prologue");
    rest_.remove_prefix(at + end.size());
    skip_space();
  }
  std::string name() {
    std::string result;
    while (!rest_.empty() && is_name_character(rest_.front())) {
      result += rest_.front();
      rest_.remove_prefix(1);
    }
    if (result.empty() || std::isalpha(static_cast<unsigned char>(result.front())) == 0) fail("no name");
    return result;
  }

  /// One character of text or one reference; '<' and lone '&' are mistakes, and so is what XML 1.0 does not
  /// allow.
  void character(std::string& out) {
    const char c = rest_.front();
    if (c == '&') {
      reference(out);
      return;
    }
    const auto code = static_cast<unsigned char>(c);
    if (c == '<' || (code < 0x20 && !is_space(c)) || code == 0x7F) fail("a character that is not allowed");
    out += c;
    rest_.remove_prefix(1);
  }
  void reference(std::string& out) {
    const std::size_t end = rest_.find(';');
    if (end > 8) fail("an open reference");
    const std::string body(rest_.substr(1, end - 1));
    static const std::map<std::string, char> known{{"amp", '&'},  {"lt", '<'},  {"gt", '>'},   {"quot", '"'},
                                                   {"#39", '\''}, {"#9", '\t'}, {"#10", '\n'}, {"#13", '\r'}};
    const auto found = known.find(body);
    if (found == known.end()) fail("an unknown reference");
    out += found->second;
    rest_.remove_prefix(end + 1);
  }

  void attributes(XmlElement& element) {
    while (true) {
      const bool spaced = !rest_.empty() && is_space(rest_.front());
      skip_space();
      if (rest_.starts_with(">") || rest_.starts_with("/>")) return;
      if (!spaced) fail("no space before an attribute");
      const std::string key = name();
      need("=\"");
      std::string value;
      while (!rest_.empty() && rest_.front() != '"')
        character(value);
      need("\"");
      if (!element.attributes.emplace(key, value).second) fail("attribute " + key + " twice");
    }
  }

  XmlElement element() {
    need("<");
    XmlElement result;
    result.name = name();
    attributes(result);
    if (take("/>")) return result;
    need(">");
    if (++depth_ > 100) fail("too deep");
    while (!rest_.starts_with("</")) {
      if (rest_.empty()) fail("<" + result.name + "> is never closed");
      if (rest_.front() == '<') {
        result.children.push_back(element());
      } else {
        character(result.text);
      }
    }
    --depth_;
    need("</" + result.name + ">");
    return result;
  }

  std::string_view rest_;
  std::string_view whole_;
  int depth_ = 0;
};

void collect(const XmlElement& element, std::vector<const XmlElement*>& into) {
  into.push_back(&element);
  for (const XmlElement& child : element.children)
    collect(child, into);
}

}  // namespace

std::vector<const XmlElement*> XmlElement::all() const {
  std::vector<const XmlElement*> elements;
  collect(*this, elements);
  return elements;
}

std::vector<const XmlElement*> XmlElement::all(std::string_view element_name) const {
  std::vector<const XmlElement*> elements = all();
  std::erase_if(elements, [&](const XmlElement* element) { return element->name != element_name; });
  return elements;
}

std::string XmlElement::whole_text() const {
  std::string result;
  for (const XmlElement* element : all())
    result += element->text + '\n';
  return result;
}

XmlElement parse_strictly(std::string_view document) {
  return Reader(document).document();
}

}  // namespace hil::report::test
