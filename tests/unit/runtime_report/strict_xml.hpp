#pragma once
// A strict reader of the XML that reports are written in, for tests: no recovery, no entities but the five
// and numeric ones, no comments, no CDATA. Throws std::runtime_error with the byte at the first mistake.

#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace hil::report::test {

struct XmlElement {
  std::string name;
  std::map<std::string, std::string> attributes;
  std::string text;  ///< its own, references resolved, without that of its children
  std::vector<XmlElement> children;

  /// This element and everything below it, in document order.
  std::vector<const XmlElement*> all() const;
  std::vector<const XmlElement*> all(std::string_view element_name) const;
  /// Text of this element and everything below it.
  std::string whole_text() const;
};

/// `document` may begin with an XML declaration or <!DOCTYPE html>.
XmlElement parse_strictly(std::string_view document);

}  // namespace hil::report::test
